//! One channel: its values and the properties that a recording needs.

use super::bytes::{Bytes, Kind};
use crate::bounds::Budget;
use crate::error::Result;
use crate::recording::column_table::damaged;

/// Values of a channel.
#[derive(Debug)]
pub(super) enum Data {
    Numbers(Vec<f64>),
    Texts(Vec<String>),
    Other(String),
}

/// What the properties say of the times of the values.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Waveform {
    /// Seconds between values.
    pub increment: Option<f64>,
    /// Seconds from the start to the first value.
    pub offset: f64,
    /// The start, seconds since 1970.
    pub start: Option<f64>,
}

/// One channel of a file.
#[derive(Debug)]
pub(super) struct Channel {
    pub group: String,
    pub name: String,
    pub unit: Option<String>,
    pub waveform: Waveform,
    /// Whether its values lack the scale that its properties describe.
    pub unscaled: bool,
    pub steps: bool,
    pub data: Data,
}

impl Channel {
    /// By a path such as `/'group'/'channel'`; `None` for the file and its groups.
    pub(super) fn of(path: &str) -> Option<Self> {
        let parts = parts(path);
        let [group, name] = <[String; 2]>::try_from(parts).ok()?;
        Some(Self {
            group,
            name,
            unit: None,
            waveform: Waveform::default(),
            unscaled: false,
            steps: false,
            data: Data::Numbers(Vec::new()),
        })
    }

    pub(super) fn is_empty(&self) -> bool {
        match &self.data {
            Data::Numbers(values) => values.is_empty(),
            Data::Texts(texts) => texts.is_empty(),
            Data::Other(_) => false,
        }
    }

    /// The column's name: with its group where there are several, and with its unit.
    pub(super) fn column_name(&self, one_group: bool) -> String {
        let mut name = if one_group { self.name.clone() } else { format!("{}.{}", self.group, self.name) };
        if let Some(unit) = self.unit.as_deref().map(str::trim).filter(|u| !u.is_empty())
            && !self.name.ends_with(unit)
            && !self.name.ends_with([']', ')'])
        {
            name += &format!(" [{unit}]");
        }
        name
    }

    /// Takes a property.
    pub(super) fn property(&mut self, name: &str, value: Property) {
        match (name, value) {
            ("wf_increment", Property::Number(value)) => self.waveform.increment = Some(value),
            ("wf_start_offset", Property::Number(value)) => self.waveform.offset = value,
            ("wf_start_time", Property::Number(value)) => self.waveform.start = Some(value),
            ("unit_string", Property::Text(unit)) => self.unit = Some(unit),
            ("NI_Scaling_Status", Property::Text(status)) => self.unscaled = status == "unscaled",
            _ => {}
        }
    }

    /// Adds values of one kind, `stride` bytes apart.
    pub(super) fn add(
        &mut self,
        kind: Kind,
        raw: &[u8],
        stride: usize,
        big: bool,
        budget: &mut Budget,
    ) -> Result<()> {
        if let Kind::Sized(_, what) = kind {
            self.data = Data::Other(what.to_owned());
            return Ok(());
        }
        let Data::Numbers(values) = &mut self.data else { return Ok(()) };
        let size = kind.size();
        let count = (raw.len() + stride - size.min(raw.len())) / stride.max(1);
        budget.take(count)?;
        self.steps = kind.is_integer() && (values.is_empty() || self.steps);
        values.extend(raw.chunks(stride.max(1)).filter_map(|c| c.get(..size)).map(|c| kind.number(c, big)));
        Ok(())
    }

    /// Adds texts: the end of each, then all of them.
    pub(super) fn add_texts(
        &mut self,
        raw: &[u8],
        count: usize,
        big: bool,
        budget: &mut Budget,
    ) -> Result<()> {
        /// Values that a text takes beside its characters.
        const OVERHEAD: usize = size_of::<String>() / size_of::<f64>() + 1;
        if matches!(&self.data, Data::Numbers(values) if values.is_empty()) {
            self.data = Data::Texts(Vec::new());
        }
        let Data::Texts(texts) = &mut self.data else { return Ok(()) };
        let characters_at = count.checked_mul(4).ok_or_else(|| damaged("it announces too many texts"))?;
        let mut ends = Bytes { rest: raw, big };
        let characters = raw.get(characters_at..).ok_or_else(|| damaged("its texts are cut off"))?;
        budget.take(count.saturating_mul(OVERHEAD).saturating_add(characters.len() / 8))?;
        let mut from = 0;
        for _ in 0..count {
            let to = ends.u32()? as usize;
            let text = characters
                .get(from..to)
                .ok_or_else(|| damaged("the ends of its texts contradict one another"))?;
            texts.push(String::from_utf8_lossy(text).into_owned());
            from = to;
        }
        Ok(())
    }
}

/// The value of a property.
#[derive(Debug)]
pub(super) enum Property {
    Number(f64),
    Text(String),
}

impl Property {
    pub(super) fn read(bytes: &mut Bytes<'_>) -> Result<Self> {
        let number = bytes.u32()?;
        let kind =
            Kind::of(number).ok_or_else(|| damaged(format!("a property has the unknown type {number}")))?;
        if kind == Kind::Text {
            return bytes.text().map(Self::Text);
        }
        let big = bytes.big;
        Ok(Self::Number(kind.number(bytes.take(kind.size())?, big)))
    }
}

/// The names in a path; a quote in a name is doubled.
fn parts(path: &str) -> Vec<String> {
    let mut parts = Vec::new();
    let mut rest = path;
    while let Some(quoted) = rest.strip_prefix("/'") {
        let mut name = String::new();
        let mut characters = quoted.char_indices().peekable();
        let mut end = quoted.len();
        while let Some((at, character)) = characters.next() {
            if character != '\'' {
                name.push(character);
            } else if characters.next_if(|(_, next)| *next == '\'').is_some() {
                name.push('\'');
            } else {
                end = at + 1;
                break;
            }
        }
        parts.push(name);
        rest = &quoted[end..];
    }
    parts
}
