// Reports words of ../words.tsv, the terms that this project replaces by those of its glossary.
"use strict";

const fs = require("fs");
const path = require("path");

function load(file) {
    const entries = [];
    fs.readFileSync(file, "utf8").split("\n").forEach((line, index) => {
        if (line.startsWith("#") || line.trim() === "") return;
        const [pattern, term, example] = line.split("\t");
        if (!example) throw new Error(`${file}:${index + 1}: three columns are required: pattern, term, example`);
        const source = `(?<![\\w-])(?:${pattern})(?![\\w-])`;
        // An entry that does not find its own example would never find anything.
        if (!new RegExp(source, "i").test(example)) {
            throw new Error(`${file}:${index + 1}: the pattern does not find its example "${example}"`);
        }
        entries.push({ source, term });
    });
    return entries;
}

const entries = load(path.join(__dirname, "..", "words.tsv"));

module.exports = function (context) {
    const { Syntax, RuleError, report, getSource, locator } = context;
    // Quotations and link targets are not this project's own words; code is not a `Str` node.
    const skipped = new Set([Syntax.BlockQuote]);
    const inside = (node) => {
        for (let up = node.parent; up; up = up.parent) if (skipped.has(up.type)) return true;
        return false;
    };
    return {
        [Syntax.Str](node) {
            if (inside(node)) return;
            const text = getSource(node).replace(/\s/g, " ");
            // Error codes are names that scripts use, and the titles of their pages.
            if (/^[a-z]+::[a-z-]+$/.test(text)) return;
            for (const { source, term } of entries) {
                for (const match of text.matchAll(new RegExp(source, "gi"))) {
                    const range = [match.index, match.index + match[0].length];
                    report(node, new RuleError(`"${match[0]}": write ${term}`, { padding: locator.range(range) }));
                }
            }
        },
    };
};
