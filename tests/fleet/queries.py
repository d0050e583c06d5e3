"""Runs the SQL and Python blocks of a page of the book in the current folder. Every query must give at least one row."""

import contextlib
import io
import re
import sys

import duckdb

page = open(sys.argv[1], encoding="utf-8").read()
blocks = re.findall(r"^```(sql|python)\n(.*?)^```", page, re.M | re.S)
queries = 0
for language, code in blocks:
    if language == "python":
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            exec(code, {})
        assert "mini-" in printed.getvalue(), printed.getvalue()
        queries += 1
        continue
    text = "\n".join(line for line in code.splitlines() if not line.startswith("--"))
    for query in filter(None, (q.strip() for q in text.split(";"))):
        rows = duckdb.sql(query).fetchall()
        # No effect may be named for four healthy muscles.
        assert rows or "effect IS NOT NULL" in query, query
        queries += 1
assert queries >= 5, queries
