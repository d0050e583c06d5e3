// Reports sentences of more than 35 words. Microsoft's style guide requires short sentences without a number; plain-language guides
// recommend 15 to 20 words on average and at most 30 to 35. A semicolon or a colon ends a sentence here: a list behind a colon counts
// separately.
"use strict";

const MOST = 35;

module.exports = function (context) {
    const { Syntax, RuleError, report, getSource, locator } = context;
    return {
        [Syntax.Paragraph](node) {
            // Lines of a paragraph are joined, and code counts as one word of the same length.
            const text = getSource(node)
                .replace(/`[^`]*`/g, (code) => "x".repeat(code.length))
                .replace(/\]\([^)]*\)/g, (target) => "x".repeat(target.length))
                .replace(/\n/g, " ");
            let from = 0;
            for (const end of text.matchAll(/[.!?](?=["”)*_]*(?:\s+["“(*_[]*[A-Zx`<]|\s*$))|[;:](?=\s)|$/g)) {
                const sentence = text.slice(from, end.index);
                const words = sentence.split(/\s+/).filter((word) => /[A-Za-z0-9]/.test(word));
                if (words.length > MOST) {
                    const start = from + (sentence.length - sentence.trimStart().length);
                    report(node, new RuleError(`sentence of ${words.length} words; at most ${MOST}`, { padding: locator.at(start) }));
                }
                from = end.index + 1;
            }
        },
    };
};
