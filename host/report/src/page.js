for (const buttons of document.querySelectorAll('.save')) buttons.hidden = false;
document.addEventListener('click', (event) => {
  const kind = event.target.dataset && event.target.dataset.save;
  if (!kind) return;
  const figure = event.target.closest('figure');
  let text;
  if (kind === 'csv') {
    text = figure.querySelector('script').textContent.replaceAll('&lt;', '<').replaceAll('&amp;', '&');
  } else {
    const picture = figure.querySelector('svg').cloneNode(true);
    const style = document.createElementNS('http://www.w3.org/2000/svg', 'style');
    style.textContent = document.getElementById('figure-style').textContent;
    picture.prepend(style);
    text = new XMLSerializer().serializeToString(picture);
  }
  const link = document.createElement('a');
  link.href = URL.createObjectURL(new Blob([text], { type: kind === 'csv' ? 'text/csv' : 'image/svg+xml' }));
  link.download = `${figure.id}.${kind}`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
});
