//! The JSON Schemas in `docs/schema`, for tests of what the program prints.
//!
//! ```
//! let schemas = published_schemas::Schemas::read().unwrap();
//! let document = serde_json::json!({ "schema": "pam-fit/1" });
//! let errors = schemas.check(&document).unwrap();
//! assert!(errors.iter().any(|e| e.contains("required")));
//! ```

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::OnceLock;

use serde_json::Value;

/// The document that a command printed, which is valid by the schema that it names.
///
/// # Panics
/// The text is no JSON, names no published schema, or is invalid.
#[must_use]
#[allow(clippy::panic, reason = "for tests")]
pub fn valid(text: &str) -> Value {
    let document: Value = serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}: {text}"));
    static ALL: OnceLock<Schemas> = OnceLock::new();
    let schemas = ALL.get_or_init(|| Schemas::read().unwrap_or_else(|e| panic!("docs/schema: {e}")));
    match schemas.check(&document) {
        Ok(errors) if errors.is_empty() => document,
        Ok(errors) => panic!("{} is invalid: {errors:#?}", document["schema"]),
        Err(error) => panic!("{error}: {text}"),
    }
}

/// All published schemas by name, such as `pam-fit/1`.
pub struct Schemas(BTreeMap<String, Value>);

impl Schemas {
    /// Reads `docs/schema`, where `pam-fit/1` is `pam-fit-1.json`.
    ///
    /// # Errors
    /// A file that cannot be read or is not JSON.
    pub fn read() -> std::io::Result<Self> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/schema");
        let mut all = BTreeMap::new();
        for file in std::fs::read_dir(folder)? {
            let path = file?.path();
            let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            all.insert(stem, serde_json::from_slice(&std::fs::read(&path)?)?);
        }
        Ok(Self(all))
    }

    /// The names in the form of the files, such as `pam-fit-1`.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }

    /// The violations of a document's own schema, each with its place; empty for a valid document.
    ///
    /// # Errors
    /// The document does not name a published schema, or the schema itself is invalid.
    pub fn check(&self, document: &Value) -> Result<Vec<String>, String> {
        let mut name = document["schema"].as_str().ok_or("the document names no schema")?.replace('/', "-");
        // A diagnosis against a reference has a form of its own.
        if name == "pam-diagnose-1" && document.get("reference").is_some() {
            name.push_str("-reference");
        }
        let schema = self.0.get(&name).ok_or_else(|| format!("schema {name} is not published"))?;
        let validator = jsonschema::validator_for(schema).map_err(|e| e.to_string())?;
        Ok(validator.iter_errors(document).map(|e| format!("{e} at {}", e.instance_path())).collect())
    }
}
