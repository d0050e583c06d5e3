//! The messages of the link as data, for programs in other languages: `clients/link.json`, from the types that both sides are compiled
//! from. `LINK=overwrite` rewrites it.

#![allow(clippy::unwrap_used)] // what fails here fails the test

use model_core::link::endpoints::*;
use model_core::link::messages::{Event, Refusal, Telemetry};
use model_core::link::{Endpoint, LINK_VERSION, SCHEMA_HASH};
use postcard_schema::Schema;
use serde_json::{Value, json};

fn row<E: Endpoint>() -> Value {
    let row = TABLE.iter().find(|row| row.id == E::ID).unwrap();
    json!({
        "number": row.id,
        "name": row.name,
        "what": row.what.split_whitespace().collect::<Vec<_>>().join(" "),
        "request": E::Request::SCHEMA,
        "response": E::Response::SCHEMA,
    })
}

macro_rules! rows {
    ($($endpoint:ident),* $(,)?) => { vec![$(row::<$endpoint>()),*] };
}

#[test]
fn the_published_messages_are_those_of_the_types() {
    let rows = rows![
        GetInfo,
        GetStatus,
        Arm,
        StartMode,
        Stop,
        Disarm,
        SetTo,
        SetReference,
        SetReferencePoints,
        SetTelemetry,
        GetFaults,
        GetPastFault,
        ClearFault,
        GetSettings,
        SetSettings,
        BeginTable,
        SendTablePiece,
        CommitTable,
        ReadTable,
        RollBackTable,
        EvaluateTable,
        ArmTrace,
        GetTrace,
        ReadTrace,
        Forget,
        Restart,
        KeepAlive,
        ReadHealth,
        ReadSignals,
        GetBoardSettings,
        GetUpdate,
        BeginUpdate,
        SendUpdatePiece,
        CommitUpdate,
        ConfirmUpdate,
        RevertUpdate,
    ];
    assert_eq!(rows.len(), TABLE.len(), "an endpoint is missing in the list above");
    let link = json!({
        "schema": "pam-link/1",
        "link_version": LINK_VERSION,
        "schema_hash": format!("{SCHEMA_HASH:016x}"),
        "endpoints": rows,
        "topics": [
            { "number": TELEMETRY, "name": "telemetry", "body": Telemetry::SCHEMA },
            { "number": EVENT, "name": "event", "body": Event::SCHEMA },
        ],
        "refusal": Refusal::SCHEMA,
    });
    let text = serde_json::to_string(&link).unwrap() + "\n";
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../clients/link.json");
    if std::env::var("LINK").is_ok_and(|value| value == "overwrite") {
        std::fs::write(path, &text).unwrap();
    }
    assert_eq!(std::fs::read_to_string(path).unwrap_or_default(), text, "`LINK=overwrite` rewrites it");
}
