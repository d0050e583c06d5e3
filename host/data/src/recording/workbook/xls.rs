//! Excel workbooks before 2007.

use super::Sheets;
use crate::error::{DataCode, Error, Result};

/// These workbooks are not read: their readers allocate what a cell's address says, which a damaged file can make any size.
pub(super) fn sheets(_bytes: &[u8], _wanted: Option<&str>) -> Result<Sheets> {
    Err(Error::new(
        DataCode::RecordingContainer,
        "this is a workbook of Excel 97 to 2003 (.xls), or another older Office file",
    )
    .help("open it in a spreadsheet program, and save it as .xlsx, .ods or CSV"))
}
