// Prints what textlint found, one line each: place, message, rule. Exit status: 0 no findings, 1 findings, 3 a rule is not loaded.
//
//     node findings.mjs FINDINGS.json SAMPLE.md EXTRACTED-FOLDER
import { readFileSync } from "node:fs";
import { relative, resolve } from "node:path";

const [json, sample, extracted] = process.argv.slice(2);
const results = JSON.parse(readFileSync(json, "utf8"));

// Each item of the sample begins with the name of the rule that must report it.
const promised = readFileSync(sample, "utf8").split("\n").flatMap((line) => /^- ([\w-]+):/.exec(line)?.[1] ?? []);
const own = results.find(({ filePath }) => resolve(filePath) === resolve(sample));
const seen = new Set(own?.messages.map(({ ruleId }) => ruleId.split("/").pop()));
const silent = promised.filter((rule) => !seen.has(rule));
if (promised.length === 0 || silent.length > 0) {
    console.error(`tests/prose/run.sh: rules that report nothing on ${sample}: ${silent.join(", ") || "all"}`);
    process.exit(3);
}

const place = (filePath) => {
    const inside = relative(resolve(extracted), resolve(filePath));
    return inside.startsWith("..") ? relative(process.cwd(), resolve(filePath)) : inside.replace(/\.md$/, "");
};
let count = 0;
for (const result of results.filter((r) => r !== own).sort((a, b) => (place(a.filePath) < place(b.filePath) ? -1 : 1))) {
    for (const { line, column, message, ruleId } of result.messages) {
        console.log(`${place(result.filePath)}:${line}:${column}: ${message.trim().replace(/\s*\n\s*/g, " ")} [${ruleId.split("/").pop()}]`);
        count += 1;
    }
}
console.log(`tests/prose/run.sh: ${results.length - 1} files, ${count} findings`);
process.exit(count > 0 ? 1 : 0);
