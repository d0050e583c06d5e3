//! `host effects --json`, `pam-effects/1` and `pam-effect/1`.

use std::collections::BTreeMap;

use serde::Serialize;

/// The library of effects.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Effects {
    pub schema: &'static str,
    pub effects: Vec<Effect>,
}

/// One effect.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Effect {
    pub schema: &'static str,
    pub effect: &'static str,
    /// Where it acts.
    pub place: &'static str,
    /// Whether it is an error of the bench, never sent to a controller.
    pub bench: bool,
    pub summary: &'static str,
    pub equation: &'static str,
    pub parameters: Vec<Parameter>,
    /// Symbols of the equation that are not its parameters.
    #[serde(rename = "letters")]
    pub symbols: BTreeMap<String, String>,
    pub source: &'static str,
}

/// One parameter with its published range, SI.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(crate) struct Parameter {
    pub name: &'static str,
    /// Its symbol.
    #[serde(rename = "letter")]
    pub symbol: &'static str,
    pub unit: &'static str,
    pub low: f64,
    pub high: f64,
    /// Whether the force is proportional to it.
    pub amplitude: bool,
}
