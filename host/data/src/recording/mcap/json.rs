//! Messages in JSON: the numbers in an object, and in the objects and arrays in it.

use serde_json::Value;

use super::values::{LONGEST_ARRAY, Values};

/// Reads one message; `None` where it is not a JSON object.
pub(super) fn read(message: &[u8], values: &mut Values) -> Option<()> {
    let value: Value = serde_json::from_slice(message).ok()?;
    value.as_object()?;
    visit(&value, &mut String::new(), values);
    Some(())
}

/// The depth is that of the parser, which goes no deeper than 128.
fn visit(value: &Value, path: &mut String, values: &mut Values) {
    let length = path.len();
    let enter = |path: &mut String, name: &str| {
        if length > 0 {
            path.push('.');
        }
        path.push_str(name);
    };
    match value {
        Value::Bool(on) => values.put(path, f64::from(u8::from(*on)), true),
        // A number without a point is an integer in one message and a measurement in the next: none of them is held.
        Value::Number(number) => values.put(path, number.as_f64().unwrap_or(f64::NAN), false),
        Value::Object(fields) => {
            for (name, value) in fields {
                enter(path, name);
                visit(value, path, values);
                path.truncate(length);
            }
        }
        Value::Array(elements) if elements.len() <= LONGEST_ARRAY => {
            for (i, value) in elements.iter().enumerate() {
                enter(path, &i.to_string());
                visit(value, path, values);
                path.truncate(length);
            }
        }
        Value::Null | Value::String(_) | Value::Array(_) => {}
    }
}
