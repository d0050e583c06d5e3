//! The files inside a workbook: a change to a packed file only ever breaks its check sum, so they are packed here.

use model_core::check::crc32;

const SHEET: &str = r#"<?xml version="1.0"?><worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData><row r="1"><c r="A1" t="s"><v>0</v></c><c r="B1" t="s"><v>1</v></c><c r="C1" t="inlineStr"><is><t>displacement_mm</t></is></c></row><row r="2"><c r="A2"><v>0</v></c><c r="B2"><v>100.5</v></c><c r="C2"><v>0.1</v></c></row><row r="3"><c r="A3"><v>0.5</v></c><c r="B3"><v>101</v></c><c r="C3"><v>1.5</v></c></row></sheetData></worksheet>"#;
const STRINGS: &str = r#"<?xml version="1.0"?><sst xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main" count="2" uniqueCount="2"><si><t>time_s</t></si><si><t>pressure_kPa</t></si></sst>"#;
const BOOK: &str = r#"<?xml version="1.0"?><workbook xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main" xmlns:r="http://schemas.openxmlformats.org/officeDocument/2006/relationships"><sheets><sheet name="Run 1" sheetId="1" r:id="rId1"/></sheets></workbook>"#;
const RELATIONS: &str = r#"<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Id="rId1" Type="http://schemas.openxmlformats.org/officeDocument/2006/relationships/worksheet" Target="worksheets/sheet1.xml"/><Relationship Id="rId2" Type="http://schemas.openxmlformats.org/officeDocument/2006/relationships/sharedStrings" Target="sharedStrings.xml"/></Relationships>"#;
const CONTENT: &str = r#"<?xml version="1.0"?><office:document-content xmlns:office="urn:oasis:names:tc:opendocument:xmlns:office:1.0" xmlns:table="urn:oasis:names:tc:opendocument:xmlns:table:1.0" xmlns:text="urn:oasis:names:tc:opendocument:xmlns:text:1.0"><office:body><office:spreadsheet><table:table table:name="Run 1"><table:table-row><table:table-cell office:value-type="string"><text:p>time_s</text:p></table:table-cell><table:table-cell office:value-type="string"><text:p>pressure_kPa</text:p></table:table-cell><table:table-cell office:value-type="string"><text:p>displacement_mm</text:p></table:table-cell></table:table-row><table:table-row table:number-rows-repeated="2"><table:table-cell office:value-type="float" office:value="0.5"/><table:table-cell office:value-type="float" office:value="100" table:number-columns-repeated="2"/></table:table-row></table:table></office:spreadsheet></office:body></office:document-content>"#;

/// The files of a workbook that the target changes, by the first byte of its input.
const CHANGED: [(&str, &str); 5] = [
    ("xl/worksheets/sheet1.xml", SHEET),
    ("xl/sharedStrings.xml", STRINGS),
    ("xl/workbook.xml", BOOK),
    ("xl/_rels/workbook.xml.rels", RELATIONS),
    ("content.xml", CONTENT),
];

/// A ZIP archive whose files are stored as they are.
fn packed(files: &[(&str, &[u8])]) -> Vec<u8> {
    let (mut archive, mut list) = (Vec::new(), Vec::new());
    for (name, bytes) in files {
        let offset = archive.len() as u32;
        let length = (bytes.len() as u32).to_le_bytes();
        let about = [
            &[20, 0, 0, 0, 0, 0, 0, 0, 0, 0][..],
            &crc32(bytes).to_le_bytes(),
            &length,
            &length,
            &(name.len() as u16).to_le_bytes(),
            &[0, 0],
        ]
        .concat();
        archive.extend([&b"PK\x03\x04"[..], &about, name.as_bytes(), bytes].concat());
        list.extend(
            [&b"PK\x01\x02\x14\0"[..], &about, &[0; 10], &offset.to_le_bytes(), name.as_bytes()].concat(),
        );
    }
    let (start, count) = (archive.len() as u32, (files.len() as u16).to_le_bytes());
    archive.extend_from_slice(&list);
    archive.extend(b"PK\x05\x06\0\0\0\0");
    archive.extend([count, count].concat());
    archive.extend([(list.len() as u32).to_le_bytes(), start.to_le_bytes()].concat());
    archive.extend([0, 0]);
    archive
}

/// A workbook of which one file is replaced.
fn workbook(which: usize, replaced: &[u8]) -> Vec<u8> {
    let excel = which < 4;
    let files: Vec<(&str, &[u8])> = CHANGED
        .iter()
        .enumerate()
        .filter(|(at, _)| (*at < 4) == excel)
        .map(|(at, (name, text))| (*name, if at == which { replaced } else { text.as_bytes() }))
        .collect();
    packed(&files)
}

/// The first byte says which file of a workbook the others are.
pub fn sheet(bytes: &[u8]) {
    let Some((&first, text)) = bytes.split_first() else { return };
    super::reader(&workbook(usize::from(first) % CHANGED.len(), text));
}

/// Sound inputs of the target.
pub fn seeds() -> Vec<Vec<u8>> {
    CHANGED.iter().enumerate().map(|(at, (_, text))| [&[at as u8], text.as_bytes()].concat()).collect()
}
