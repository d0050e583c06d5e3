// Legend entries are buttons that hide a layer and show it again, in both layouts of the picture.
for (const entry of document.querySelectorAll('g.entry')) {
  const figure = entry.closest('figure'), name = entry.dataset.layer;
  const same = (kind) => [...figure.querySelectorAll('g.' + kind)].filter((g) => g.dataset.layer === name);
  if (!same('layer').length) continue;
  const press = () => {
    const shown = entry.getAttribute('aria-pressed') !== 'true';
    for (const g of same('layer')) g.classList.toggle('off', !shown);
    for (const g of same('entry')) g.setAttribute('aria-pressed', shown);
  };
  for (const [key, value] of [['role', 'button'], ['tabindex', '0'], ['aria-pressed', 'true'], ['aria-label', 'show ' + name]]) entry.setAttribute(key, value);
  entry.addEventListener('click', press);
  entry.addEventListener('keydown', (event) => { if (event.key === 'Enter' || event.key === ' ') { event.preventDefault(); press(); } });
}

// The numbers behind a picture, from the same text that the button saves: rows with panel, layer, abscissa, ordinate, low, and high.
const numbersOf = new WeakMap();
function numbers(figure) {
  if (numbersOf.has(figure)) return numbersOf.get(figure);
  const text = figure.querySelector('script').textContent.replaceAll('&lt;', '<').replaceAll('&amp;', '&');
  const cells = (line) => [...line.matchAll(/(?:^|,)(?:"((?:[^"]|"")*)"|([^,]*))/g)].map((m) => (m[1] === undefined ? m[2] : m[1].replaceAll('""', '"')));
  const rows = [], value = (cell) => (cell === undefined || cell === '' ? NaN : Number(cell));
  for (const table of text.split('\n\n')) {
    const [head, ...lines] = table.split('\n'), first = cells(head)[0] === 'panel' ? 1 : 0;
    for (const line of lines) {
      if (!line) continue;
      const c = cells(line);
      rows.push({ panel: first ? c[0] : null, layer: c[first], x: value(c[first + 1]), y: value(c[first + 2]), low: value(c[first + 3]), high: value(c[first + 4]) });
    }
  }
  numbersOf.set(figure, rows);
  return rows;
}

const reading = Object.assign(document.createElement('div'), { id: 'reading', hidden: true });
reading.setAttribute('role', 'status');
document.body.append(reading);
const spot = document.createElementNS('http://www.w3.org/2000/svg', 'circle');
spot.setAttribute('r', '4.5'); spot.setAttribute('fill', 'none'); spot.setAttribute('stroke', 'var(--ink)'); spot.setAttribute('stroke-width', '1.6'); spot.setAttribute('pointer-events', 'none');

function unread() { reading.hidden = true; spot.remove(); }
function read(event) {
  const place = event.target;
  if (!place.classList || !place.classList.contains('read')) { unread(); return; }
  const figure = place.closest('figure'), box = place.getBoundingClientRect(), log = place.dataset.log;
  const axis = (name) => {
    const [from, to] = place.dataset[name].split(' ').map(Number), logarithmic = log.includes(name);
    return { part: (v) => (logarithmic ? Math.log(v / from) / Math.log(to / from) : (v - from) / (to - from)), at: (p) => (logarithmic ? from * (to / from) ** p : from + p * (to - from)) };
  };
  const x = axis('x'), y = axis('y'), px = (event.clientX - box.left) / box.width, py = 1 - (event.clientY - box.top) / box.height;
  const hidden = new Set([...figure.querySelectorAll('g.layer.off')].map((g) => g.dataset.layer));
  // The nearest point that is drawn, by its distance on the screen.
  let nearest = null, distance = Infinity;
  for (const row of numbers(figure)) {
    if ((row.panel !== null && row.panel !== place.dataset.panel) || hidden.has(row.layer) || !Number.isFinite(row.x)) continue;
    const field = Number.isFinite(row.y) && Number.isFinite(row.low);
    const height = field ? (row.low + row.high) / 2 : Number.isFinite(row.y) ? row.y : (row.low + row.high) / 2;
    const away = Math.hypot((x.part(row.x) - px) * box.width, (y.part(height) - py) * box.height);
    if (away < distance) { distance = away; nearest = { ...row, height, field }; }
  }
  const figures = (v) => String(Number(v.toPrecision(4))), line = (title, v) => `${title}: ${figures(v)}`;
  const words = [];
  if (nearest && (distance < 30 || nearest.field)) {
    words.push(nearest.layer || 'value', line(place.dataset.xTitle, nearest.x));
    if (nearest.field) words.push(line(place.dataset.yTitle, nearest.height), line('value', nearest.y));
    else if (Number.isFinite(nearest.y)) words.push(line(place.dataset.yTitle, nearest.y));
    else words.push(`${place.dataset.yTitle}: ${figures(nearest.low)} to ${figures(nearest.high)}`);
    const svg = place.ownerSVGElement, number = (name) => Number(place.getAttribute(name));
    spot.setAttribute('cx', number('x') + x.part(nearest.x) * number('width'));
    spot.setAttribute('cy', number('y') + (1 - y.part(nearest.height)) * number('height'));
    svg.append(spot);
  } else {
    spot.remove();
    words.push(line(place.dataset.xTitle, x.at(px)), line(place.dataset.yTitle, y.at(py)));
  }
  reading.textContent = words.join('\n'); reading.style.whiteSpace = 'pre-line'; reading.hidden = false;
  const wide = reading.offsetWidth, left = Math.min(event.pageX + 14, scrollX + document.documentElement.clientWidth - wide - 4);
  reading.style.left = `${Math.max(scrollX + 4, left)}px`; reading.style.top = `${event.pageY + 16}px`;
}
document.addEventListener('pointermove', read);
document.addEventListener('pointerdown', read);
document.addEventListener('pointerleave', unread);
