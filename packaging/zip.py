"""Packs a folder into a ZIP file: the same contents always give the same bytes.

    python3 packaging/zip.py FOLDER FILE

Needs the standard library of Python 3.11.
"""

import pathlib
import sys
import zipfile

folder, packed = map(pathlib.Path, sys.argv[1:])
with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
    for path in sorted(folder.rglob("*")):
        if path.is_file():
            entry = zipfile.ZipInfo(str(pathlib.PurePosixPath(path.relative_to(folder.parent))), (1980, 1, 1, 0, 0, 0))
            entry.external_attr = (path.stat().st_mode & 0xFFFF) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, path.read_bytes())
