#!/usr/bin/env bash
# Checks the subjects of commits: "area: imperative", at most 72 characters, no full stop. Commits up to the base are not checked.
#
#     bash tests/commits.sh
set -euo pipefail
cd "$(dirname "$0")/.."

base=203b50563eaf
if ! git merge-base --is-ancestor "$base" HEAD 2>/dev/null; then
    echo "tests/commits.sh: skipped: the history does not contain $base"
    exit 0
fi
wrong=$(git log --no-merges --format=%s "$base..HEAD" | grep -vE '^[a-z0-9][a-z0-9 ,./_-]{1,30}: [^ ].{2,}[^.]$' || true)
long=$(git log --no-merges --format=%s "$base..HEAD" | awk 'length > 72' || true)
if [ -n "$wrong$long" ]; then
    printf 'tests/commits.sh: a subject is "area: imperative", at most 72 characters, without a full stop; change these:\n%s\n' "$wrong$long" >&2
    exit 1
fi
