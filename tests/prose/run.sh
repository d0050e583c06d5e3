#!/usr/bin/env bash
# Checks the language of the book and of the other pages with textlint: Google's developer documentation style guide, and the
# project's own word list (words.tsv).
#
#     bash tests/prose/run.sh              # pages
#     bash tests/prose/run.sh --sources    # and messages, help, and comments of the sources: about 40 s
#     bash tests/prose/run.sh FILE…        # these files only
#
# Installs the pinned versions (package-lock.json) into target/prose on the first run. Exit status: 0 no findings, 1 findings,
# 3 the linter cannot be installed.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
cd "$here/../.."
work=${CARGO_TARGET_DIR:-target}/prose
mkdir -p "$work"
work=$(cd "$work" && pwd)

sources=no
files=()
for argument in "$@"; do
    case $argument in
        --sources) sources=yes ;;
        -*) echo "tests/prose/run.sh: unknown option '$argument'; options: --sources" >&2; exit 2 ;;
        *) files+=("$argument") ;;
    esac
done

if ! command -v npm >/dev/null; then
    echo "tests/prose/run.sh: npm is required; install Node.js 20 or later with npm" >&2
    exit 3
fi
if ! cmp -s "$here/package-lock.json" "$work/installed.json"; then
    cp "$here/package.json" "$here/package-lock.json" "$here/.npmrc" "$work/"
    if ! (cd "$work" && npm ci --ignore-scripts --silent); then
        echo "tests/prose/run.sh: the linter cannot be installed: 'npm ci' failed in $work" >&2
        exit 3
    fi
    cp "$here/package-lock.json" "$work/installed.json"
fi

# Sources become Markdown files with the same line numbers.
extracted=$work/sources
rm -rf "$extracted"
markdown=()
code=()
if [ ${#files[@]} -gt 0 ]; then
    for file in "${files[@]}"; do
        case $file in
            *.rs | *.js | *.mjs | *.html | *.py | *.sh | *.toml) code+=("$file") ;;
            *) markdown+=("$file") ;;
        esac
    done
else
    while IFS= read -r file; do markdown+=("$file"); done \
        < <(git ls-files --cached --others --exclude-standard 'docs/*.md' '*README.md' CHANGELOG.md CONTRIBUTING.md SECURITY.md | sort -u)
    if [ $sources = yes ]; then
        while IFS= read -r file; do code+=("$file"); done < <(git ls-files --cached --others --exclude-standard '*.rs' '*.js' '*.mjs' 'host/*.html' '*.py' '*.sh' '*.toml' | sort -u)
    fi
fi
if [ ${#code[@]} -gt 0 ]; then
    node "$here/extract.mjs" "$extracted" "${code[@]}"
    while IFS= read -r file; do markdown+=("$file"); done < <(find "$extracted" -name '*.md' | sort)
fi
if [ ${#markdown[@]} -eq 0 ]; then
    echo "tests/prose/run.sh: no files to check" >&2
    exit 2
fi

"$work/node_modules/.bin/textlint" --config "$here/textlintrc.json" --rulesdir "$here/rules" \
    --rules-base-directory "$work/node_modules" --format json "$here/sample.md" "${markdown[@]}" \
    >"$work/findings.json" 2>"$work/errors.txt" || status=$?
# 1 means findings; anything above, or an answer that is not JSON, is a failure of the linter itself.
if [ "${status:-0}" -gt 1 ] || ! node -e 'JSON.parse(require("fs").readFileSync(process.argv[1]))' "$work/findings.json" 2>/dev/null; then
    cat "$work/errors.txt" "$work/findings.json" >&2
    echo "tests/prose/run.sh: the linter failed" >&2
    exit 3
fi
node "$here/findings.mjs" "$work/findings.json" "$here/sample.md" "$extracted"
