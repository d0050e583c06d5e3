// Writes the prose of sources as Markdown with the same line numbers: of Rust and JavaScript, comments, and string literals that are
// sentences; of HTML, text; of Python, shell, and TOML, comments.
//
//     node extract.mjs FOLDER FILE…
//
// A string counts as prose if it has at least four words of letters and no mark of another language (markup, code, a path).
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";

const PROSE = /[A-Za-z]{2,}[,;:]? [a-z]{2,}[,;:]? [a-z{]+[,;:]? [a-z{]/;
const OTHER_LANGUAGE = /[<>]|[;{]\s*$|=>|\bfn \b|::[a-z]+\(|^\s*[.#][\w-]+\s*\{|\$\{|function ?\(/m;

/// The pieces of a source: comments and strings with their first line.
function pieces(text) {
    const out = [];
    let at = 0;
    let line = 1;
    const advance = (to) => {
        for (; at < to; at++) if (text[at] === "\n") line++;
    };
    while (at < text.length) {
        const rest = text.slice(at, at + 24);
        let m;
        if (rest.startsWith("//")) {
            const end = text.indexOf("\n", at);
            const stop = end < 0 ? text.length : end;
            out.push({ kind: "comment", line, text: text.slice(at, stop).replace(/^\/\/[/!]? ?/, "") });
            advance(stop);
        } else if (rest.startsWith("/*")) {
            const end = text.indexOf("*/", at);
            advance(end < 0 ? text.length : end + 2);
        } else if ((m = /^b?r(#*)"/.exec(rest)) && !/\w/.test(text[at - 1] ?? " ")) {
            const close = `"${m[1]}`;
            const from = at + m[0].length;
            const end = text.indexOf(close, from);
            const stop = end < 0 ? text.length : end;
            out.push({ kind: "string", line, text: text.slice(from, stop) });
            advance(stop + close.length);
        } else if (rest[0] === '"') {
            let stop = at + 1;
            while (stop < text.length && text[stop] !== '"') stop += text[stop] === "\\" ? 2 : 1;
            // A backslash at a line's end joins the lines; keep the line break for the numbering.
            // A line that begins with two spaces is code: an example of a command, a line of a grammar.
            const prose = text.slice(at + 1, stop).replace(/\\n {2}(?:\\\\|\\\n|\\(?=["])|(?!\\n).)*/gs, (code) => code.replace(/[^\n]/g, ""))
                // A row of a table is no sentence; pages with the table are checked themselves.
                .replace(/\\n(?:\\\n *)?\| (?:(?!\\n).)* \|(?=\\n|$)/gs, (row) => row.replace(/[^\n]/g, ""));
            const body = prose.replace(/\\\n/g, "\n").replace(/([.:;,!?]?)(?:\\n)+/g, (_, mark) => `${mark || "."} `).replace(/\\(["\\])/g, "$1");
            out.push({ kind: "string", line, text: body });
            advance(stop + 1);
        } else if ((m = /^'(?:\\.[^']*|[^'\\\n])'/.exec(rest))) {
            advance(at + m[0].length);
        } else {
            advance(at + 1);
        }
    }
    return out;
}

/// Lines of Markdown, as many as the source has: comments of consecutive lines stay one paragraph, strings are sentences of their own.
function markdown(text) {
    const lines = Array(text.split("\n").length).fill("");
    let fence = false;
    let previous = "comment";
    // A string does not continue the text before it, nor a comment a string: each is an item of a list.
    const item = (kind, line, body) => {
        const separate = kind === "string" || previous === "string";
        previous = kind;
        return separate && lines[line - 1] === "" ? `- ${body}` : body;
    };
    for (const { kind, line, text: body } of pieces(text)) {
        if (kind === "comment") {
            if (/^\s*```/.test(body)) {
                fence = !fence;
                continue;
            }
            // Code, lists of symbols and drawings are indented.
            if (!fence && !/^ {2,}/.test(body)) {
                lines[line - 1] = item(kind, line, body);
            }
        } else if (PROSE.test(body) && !OTHER_LANGUAGE.test(body)) {
            body.split("\n").forEach((part, k) => {
                const clean = part.replace(/\{[^}]*\}/g, "`0`").replace(/ +/g, " ").trim();
                const start = k === 0 ? item(kind, line, "") : "";
                lines[line - 1 + k] = `${lines[line - 1 + k]} ${start}${clean}`.trim();
            });
        }
    }
    return lines.map((l) => l.replace(/^#+ /, "")).join("\n");
}

/// Comments after a `#` at the beginning of a line.
function remarks(text) {
    return text
        .split("\n")
        .map((line) => /^\s*#(?!!)\s?(.*)$/.exec(line)?.[1] ?? "")
        .map((line) => (/^ {2,}/.test(line) ? "" : line))
        .join("\n");
}

/// Text between the tags of a page.
function visible(text) {
    const blank = (piece) => piece.replace(/[^\n]/g, " ");
    return text.replace(/<(script|style)[\s\S]*?<\/\1>|<!--[\s\S]*?-->|<[^>]*>/g, blank).replace(/^ +/gm, "");
}

function extracted(file, text) {
    if (/\.(rs|js|mjs)$/.test(file)) return markdown(text);
    return file.endsWith(".html") ? visible(text) : remarks(text);
}

const [folder, ...files] = process.argv.slice(2);
for (const file of files) {
    const target = join(folder, `${file}.md`);
    mkdirSync(dirname(target), { recursive: true });
    writeFileSync(target, extracted(file, readFileSync(file, "utf8")));
}
