//! The JSON that commands print, one struct per document. `docs/schema` holds the JSON Schema of each, generated from these types.

pub(crate) mod bench;
pub(crate) mod campaign;
pub(crate) mod device;
pub(crate) mod effects;
pub(crate) mod evaluate;
#[cfg(test)]
mod fit;
pub(crate) mod fleet;
pub(crate) mod health;
pub(crate) mod history;
pub(crate) mod import;
pub(crate) mod predict;
pub(crate) mod recording;
pub(crate) mod stock;
pub(crate) mod table;

use pam_data::error::{DataCode, Error, Result};
use serde::Serialize;

/// A document as indented text.
///
/// # Errors
/// None in practice: every document can be written.
pub(crate) fn text(document: &impl Serialize) -> Result<String> {
    serde_json::to_string_pretty(document).map_err(|e| Error::new(DataCode::FileUnwritable, e.to_string()))
}

/// A document on one line.
///
/// # Errors
/// As [`text`].
pub(crate) fn line(document: &impl Serialize) -> Result<String> {
    serde_json::to_string(document).map_err(|e| Error::new(DataCode::FileUnwritable, e.to_string()))
}

#[cfg(test)]
mod tests {
    use schemars::{JsonSchema, schema_for};

    fn published<T: JsonSchema>(name: &str) {
        let schema = format!("{:#}\n", serde_json::to_value(schema_for!(T)).unwrap());
        let path = format!("{}/../docs/schema/{name}.json", env!("CARGO_MANIFEST_DIR"));
        if std::env::var("SCHEMA").is_ok_and(|v| v == "overwrite") {
            std::fs::write(&path, &schema).unwrap();
        }
        let there = std::fs::read_to_string(&path).unwrap_or_default();
        assert_eq!(there, schema, "{name}: `SCHEMA=overwrite cargo test -p host --lib schema` rewrites it");
    }

    #[test]
    fn every_published_schema_is_that_of_the_types() {
        published::<super::campaign::Campaign>("pam-campaign-1");
        published::<super::fleet::Batch<'_>>("pam-batch-1");
        published::<super::bench::Compare>("pam-compare-1");
        published::<super::bench::Demo<'_>>("pam-demo-1");
        published::<super::bench::Emulate<'_>>("pam-emulate-1");
        published::<super::bench::Plan<'_>>("pam-plan-1");
        published::<super::bench::PlanOfRecordings<'_>>("pam-plan-protocols-1");
        published::<super::bench::Recover>("pam-recover-1");
        published::<super::bench::SettingsFiles<'_>>("pam-settings-1");
        published::<super::bench::Studio<'_>>("pam-studio-1");
        published::<super::device::Faults>("pam-faults-1");
        published::<super::device::Firmware>("pam-firmware-1");
        published::<super::device::FirmwareFile>("pam-firmware-file-1");
        published::<super::device::FirmwareKey>("pam-firmware-key-1");
        published::<super::device::Flash>("pam-flash-1");
        published::<super::device::Forget>("pam-forget-1");
        published::<super::device::Info>("pam-device-1");
        published::<super::device::LogLine<'_>>("pam-log-1");
        published::<super::device::Ports>("pam-ports-1");
        published::<super::device::Regulator>("pam-regulator-1");
        published::<super::device::Rollback>("pam-rollback-1");
        published::<super::device::Sensors>("pam-sensors-1");
        published::<super::device::Settings>("pam-device-settings-1");
        published::<super::device::Trace<'_>>("pam-trace-1");
        published::<super::device::Vent>("pam-vent-1");
        published::<super::effects::Effect>("pam-effect-1");
        published::<super::effects::Effects>("pam-effects-1");
        published::<super::evaluate::Evaluate>("pam-evaluate-1");
        published::<super::fit::Fit>("pam-fit-1");
        published::<super::health::Health>("pam-health-1");
        published::<super::history::History>("pam-history-1");
        published::<super::import::Import>("pam-import-1");
        published::<super::fleet::Fleet<'_>>("pam-fleet-1");
        published::<super::fleet::Stock<'_>>("pam-stock-1");
        published::<super::predict::Predict>("pam-predict-1");
        published::<super::stock::StockDocument>("pam-diagnose-stock-1");
        published::<super::recording::schema::Record>("pam-record-1");
        published::<super::recording::schema::Run>("pam-run-1");
        published::<super::table::Check>("pam-check-1");
        published::<super::table::Export>("pam-export-1");
        published::<super::table::TableDocument<'_>>("pam-table-1");
    }
}
