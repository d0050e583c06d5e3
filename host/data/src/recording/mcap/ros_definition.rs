//! Message definitions of ROS 1 and ROS 2, as text: `ros1msg` and `ros2msg`.
//!
//! The definition of a topic's type comes first; those of the types in it follow, each under a line of equals signs and a line
//! `MSG: package/Type`. Sources: <https://wiki.ros.org/msg> and <https://design.ros2.org/articles/legacy_interface_definition.html>.

use std::collections::HashMap;

/// Which of the two serialisations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Version {
    Ros1,
    Ros2,
}

/// The type of one field, or of an array's elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Bool,
    Signed(usize),
    Unsigned(usize),
    Float(usize),
    Text,
    /// ROS 1's `time` and `duration`: seconds and nanoseconds, the latter with a sign.
    Time {
        signed: bool,
    },
    /// Another definition, by its number.
    Message(usize),
}

/// How many there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Count {
    One,
    Fixed(usize),
    /// The length is in the message.
    LengthPrefixed,
}

/// One field of a definition.
#[derive(Debug)]
pub(super) struct Part {
    pub name: String,
    pub kind: Kind,
    pub count: Count,
}

/// The definitions of a topic; the first is that of its messages.
#[derive(Debug)]
pub(super) struct Definition {
    pub messages: Vec<Vec<Part>>,
    pub version: Version,
}

/// A part before its type is known by number.
struct Unresolved<'a> {
    name: &'a str,
    kind: &'a str,
    count: Count,
}

impl Definition {
    /// Reads a definition; the reason where it cannot be.
    pub(super) fn parse(text: &str, name: &str, version: Version) -> Result<Self, String> {
        let mut sections: Vec<(&str, Vec<Unresolved<'_>>)> = vec![(name, Vec::new())];
        for line in text.lines() {
            let line = line.split('#').next().unwrap_or_default().trim();
            // A line of `=` stands between the definitions.
            if line.bytes().all(|b| b == b'=') {
                continue;
            }
            if let Some(name) = line.strip_prefix("MSG:") {
                sections.push((name.trim(), Vec::new()));
            } else if let Some(part) = part(line)?
                && let Some((_, parts)) = sections.last_mut()
            {
                parts.push(part);
            }
        }
        let index: HashMap<&str, usize> =
            sections.iter().enumerate().rev().map(|(n, (name, _))| (*name, n)).collect();
        let find = |kind: &str, package: &str| -> Option<usize> {
            let short = kind.rsplit('/').next()?;
            let owner = kind.split_once('/').map_or(package, |(owner, _)| owner);
            let owner = if kind == "Header" { "std_msgs" } else { owner };
            let names = [kind.to_owned(), format!("{owner}/{short}"), format!("{owner}/msg/{short}")];
            names.iter().find_map(|n| index.get(n.as_str())).copied()
        };
        let mut messages = Vec::with_capacity(sections.len());
        for (name, parts) in &sections {
            let package = name.split('/').next().unwrap_or_default();
            let resolved = parts.iter().map(|p| {
                let kind = match primitive(p.kind, version) {
                    Some(kind) => kind,
                    None => Kind::Message(
                        find(p.kind, package)
                            .ok_or_else(|| format!("the definition of `{}` is not in the file", p.kind))?,
                    ),
                };
                Ok(Part { name: p.name.to_owned(), kind, count: p.count })
            });
            messages.push(resolved.collect::<Result<_, String>>()?);
        }
        Ok(Self { messages, version })
    }
}

/// One line: `float64[3] name`, `string<=10 name "default"`; none where it is a constant.
fn part(line: &str) -> Result<Option<Unresolved<'_>>, String> {
    let wrong = || format!("the line `{line}` of its definition is not understood");
    let (kind, rest) = line.split_once(char::is_whitespace).ok_or_else(wrong)?;
    let rest = rest.trim_start();
    let name = rest.split(|c: char| c.is_whitespace() || c == '=').next().unwrap_or_default();
    if rest[name.len()..].trim_start().starts_with('=') {
        return Ok(None);
    }
    let (kind, count) = match kind.strip_suffix(']').and_then(|k| k.rsplit_once('[')) {
        None => (kind, Count::One),
        Some((kind, "")) => (kind, Count::LengthPrefixed),
        Some((kind, bound)) if bound.starts_with("<=") => (kind, Count::LengthPrefixed),
        Some((kind, count)) => (kind, Count::Fixed(count.trim().parse().map_err(|_| wrong())?)),
    };
    let kind = kind.split_once("<=").map_or(kind, |(kind, _)| kind);
    if name.is_empty() || kind.is_empty() {
        return Err(wrong());
    }
    Ok(Some(Unresolved { name, kind, count }))
}

fn primitive(kind: &str, version: Version) -> Option<Kind> {
    let ros1 = version == Version::Ros1;
    Some(match kind {
        "bool" => Kind::Bool,
        "byte" if ros1 => Kind::Signed(1),
        "byte" | "char" | "uint8" => Kind::Unsigned(1),
        "int8" => Kind::Signed(1),
        "int16" => Kind::Signed(2),
        "uint16" => Kind::Unsigned(2),
        "int32" => Kind::Signed(4),
        "uint32" => Kind::Unsigned(4),
        "int64" => Kind::Signed(8),
        "uint64" => Kind::Unsigned(8),
        "float32" => Kind::Float(4),
        "float64" => Kind::Float(8),
        "string" => Kind::Text,
        "time" if ros1 => Kind::Time { signed: false },
        "duration" if ros1 => Kind::Time { signed: true },
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_defaults_bounds_and_types_of_other_packages_are_understood() {
        let text = "# A remark\nuint8 LEFT=1\nstring NAME = \"a = b\"\nfloat64[] x   # m\nint32<=3[<=5] few\nfloat32[3] g 1.0\n\
                    string<=8 label \"none\"\nHeader header\nPose pose\n================\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\n\
                    string frame_id\n===\nMSG: lab_msgs/Pose\nfloat64 x\n";
        let read = Definition::parse(text, "lab_msgs/Muscle", Version::Ros1).unwrap();
        let parts: Vec<(&str, Kind, Count)> =
            read.messages[0].iter().map(|p| (p.name.as_str(), p.kind, p.count)).collect();
        assert_eq!(
            parts,
            [
                ("x", Kind::Float(8), Count::LengthPrefixed),
                ("few", Kind::Signed(4), Count::LengthPrefixed),
                ("g", Kind::Float(4), Count::Fixed(3)),
                ("label", Kind::Text, Count::One),
                ("header", Kind::Message(1), Count::One),
                ("pose", Kind::Message(2), Count::One),
            ]
        );
        let missing = Definition::parse("a_msgs/B b\n", "lab_msgs/Muscle", Version::Ros2).unwrap_err();
        assert!(missing.contains("a_msgs/B"), "{missing}");
    }
}
