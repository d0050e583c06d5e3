//! Topics of other programs: the messages of each, decoded by its schema.

use std::collections::HashMap;

use super::ros_definition::{Definition, Version};
use super::values::Values;
use super::{json, ros};
use crate::bounds::Budget;
use crate::error::Result;
use crate::mcap_records::{Channel, Schema};

/// A larger message is a picture or a point cloud. A message of 1000 numbers takes 8 KiB.
const LARGEST_MESSAGE: usize = 1 << 20;
/// Topics and schemas of one file.
const MOST: usize = 10_000;

/// How the messages of a topic are read.
#[derive(Debug)]
enum Decoder {
    Ros(Definition),
    Json,
}

/// One topic.
#[derive(Debug)]
pub(super) struct Topic {
    /// Without the slash in front.
    pub name: String,
    /// Encoding and type, as the file has them.
    kind: String,
    decoder: Option<Decoder>,
    /// Why it has no columns.
    pub reason: Option<String>,
    /// When messages were logged, ns since 1970.
    pub logged: Vec<u64>,
    /// What their headers say, as long as every message has a stamp.
    pub stamped: Vec<u64>,
    pub values: Values,
}

impl Topic {
    /// Whether every message has a stamp in its header.
    pub(super) fn has_stamps(&self) -> bool {
        self.stamped.len() == self.logged.len()
    }

    /// Gives up on it.
    fn give_up(&mut self, reason: String) {
        self.decoder = None;
        self.values = Values::default();
        (self.logged, self.stamped) = (Vec::new(), Vec::new());
        self.reason = Some(reason);
    }
}

struct KnownSchema {
    name: String,
    encoding: String,
    data: Vec<u8>,
}

/// All topics of a file.
pub(super) struct Topics<'a> {
    /// The columns that are needed, as `topic.field`; all where it is not known.
    wanted: Option<&'a [String]>,
    schemas: HashMap<u16, KnownSchema>,
    channels: HashMap<u16, usize>,
    pub list: Vec<Topic>,
    pub budget: Budget,
}

impl<'a> Topics<'a> {
    pub(super) fn new(wanted: Option<&'a [String]>, budget: Budget) -> Self {
        Self { wanted, schemas: HashMap::new(), channels: HashMap::new(), list: Vec::new(), budget }
    }

    pub(super) fn schema(&mut self, schema: &Schema<'_>) -> Result<()> {
        if self.schemas.len() < MOST && !self.schemas.contains_key(&schema.number) {
            self.budget.take(schema.data.len() / 8 + 100)?;
            let own = KnownSchema {
                name: schema.name.to_owned(),
                encoding: schema.encoding.to_owned(),
                data: schema.data.to_vec(),
            };
            self.schemas.insert(schema.number, own);
        }
        Ok(())
    }

    pub(super) fn channel(&mut self, channel: &Channel<'_>) -> Result<()> {
        if self.channels.contains_key(&channel.number) || self.channels.len() >= MOST {
            return Ok(());
        }
        self.budget.take(channel.topic.len() / 8 + 100)?;
        let name = channel.topic.trim_start_matches('/').to_owned();
        let schema = self.schemas.get(&channel.schema);
        let of = schema.map_or(String::new(), |s| format!(" of {}", s.name));
        let kind = format!("{}{of}", channel.encoding);
        // Several programs can publish one topic.
        let at = match self.list.iter().position(|t| t.name == name) {
            Some(at) => {
                if self.list[at].kind != kind {
                    let other = self.list[at].kind.clone();
                    self.list[at].give_up(format!("messages of two kinds: {other}, and {kind}"));
                }
                at
            }
            None => {
                let (decoder, reason) = match self.decoder(&name, channel, schema) {
                    Ok(decoder) => (Some(decoder), None),
                    Err(reason) => (None, Some(reason)),
                };
                self.list.push(Topic {
                    name,
                    kind,
                    decoder,
                    reason,
                    logged: Vec::new(),
                    stamped: Vec::new(),
                    values: Values::default(),
                });
                self.list.len() - 1
            }
        };
        self.channels.insert(channel.number, at);
        Ok(())
    }

    fn decoder(
        &self,
        topic: &str,
        channel: &Channel<'_>,
        schema: Option<&KnownSchema>,
    ) -> std::result::Result<Decoder, String> {
        if self.wanted.is_some_and(|wanted| !wanted.iter().any(|column| is_of(column, topic))) {
            return Err("messages that no described column needs".into());
        }
        let definition = |schema: &KnownSchema, version| {
            let text = String::from_utf8_lossy(&schema.data);
            Definition::parse(&text, &schema.name, version).map(Decoder::Ros)
        };
        match (channel.encoding, schema) {
            ("json", _) => Ok(Decoder::Json),
            ("ros1", Some(schema)) if schema.encoding == "ros1msg" => definition(schema, Version::Ros1),
            ("cdr", Some(schema)) if schema.encoding == "ros2msg" => definition(schema, Version::Ros2),
            (encoding, Some(schema)) => Err(format!(
                "messages in `{encoding}` with a schema in `{}`, which are not read",
                schema.encoding
            )),
            (encoding, None) => Err(format!("messages in `{encoding}` without a schema")),
        }
    }

    /// Takes a message; whether its channel is known.
    pub(super) fn message(&mut self, channel: u16, logged: u64, data: &[u8]) -> Result<bool> {
        let Some(topic) = self.channels.get(&channel).and_then(|at| self.list.get_mut(*at)) else {
            return Ok(false);
        };
        let Some(decoder) = &topic.decoder else { return Ok(true) };
        if data.len() > LARGEST_MESSAGE {
            topic.give_up(format!("messages of {} bytes, which are not readings of sensors", data.len()));
            return Ok(true);
        }
        let read = match decoder {
            Decoder::Ros(definition) => ros::read(definition, data, &mut topic.values),
            Decoder::Json => json::read(data, &mut topic.values),
        };
        if read.is_none() || topic.values.too_wide {
            topic.values.abandon();
            let reason = if topic.values.too_wide {
                "messages of more than 1000 numbers, which are not readings of sensors".into()
            } else {
                let number = topic.values.rows + 1;
                format!("messages in {}, of which number {number} does not fit its definition", topic.kind)
            };
            topic.give_up(reason);
            return Ok(true);
        }
        let stamp = topic.values.end(&mut self.budget)?;
        if let Some(stamp) = stamp.filter(|_| topic.has_stamps()) {
            topic.stamped.push(stamp);
        }
        topic.logged.push(logged);
        Ok(true)
    }
}

/// Whether a column is one of a topic.
pub(super) fn is_of(column: &str, topic: &str) -> bool {
    column.strip_prefix(topic).is_some_and(|rest| rest.starts_with('.'))
}
