//! MCAP, as `mcap` reads it: topics of messages in JSON, protobuf, or CDR with the definitions of ROS 2.
//!
//! A topic is a table, a message a row, a value in it a column (`field/inner`), with all its digits;
//! the log time of the messages is the clock of the rows.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use mcap::{Channel, MessageStream};
use serde_json::Value;

use crate::groups::{Cells, Clock, Column, Group, below};
use crate::said;
use crate::{cdr, protobuf};

/// A topic while it grows.
#[derive(Default)]
struct Topic {
    columns: BTreeMap<String, Vec<String>>,
    log_time_ns: Vec<i64>,
}

/// How the messages of a channel become values.
enum Decoder {
    Json,
    Protobuf(protobuf::Decoder),
    Cdr(cdr::Decoder),
}

impl Decoder {
    /// `None` for an encoding, or a schema's, that is not read.
    fn of(channel: &Channel<'_>) -> Result<Option<Self>, String> {
        let schema = channel.schema.as_deref();
        let encoding = schema.map_or("", |schema| schema.encoding.as_str());
        Ok(
            match (channel.message_encoding.as_str(), encoding, schema) {
                ("json", ..) => Some(Self::Json),
                ("protobuf", "protobuf", Some(schema)) => {
                    let decoder = protobuf::Decoder::new(&schema.name, &schema.data)?;
                    Some(Self::Protobuf(decoder))
                }
                ("cdr", "ros2msg", Some(schema)) => {
                    Some(Self::Cdr(cdr::Decoder::new(&schema.name, &schema.data)?))
                }
                _ => None,
            },
        )
    }

    fn value(&self, bytes: &[u8]) -> Result<Value, String> {
        match self {
            Self::Json => serde_json::from_slice(bytes).map_err(said),
            Self::Protobuf(decoder) => decoder.value(bytes),
            Self::Cdr(decoder) => decoder.value(bytes),
        }
    }
}

pub(crate) fn read(bytes: &[u8]) -> Result<Vec<Group>, String> {
    let mut topics: BTreeMap<String, Topic> = BTreeMap::new();
    let mut others: BTreeMap<String, String> = BTreeMap::new();
    let mut decoders: BTreeMap<u16, Option<Decoder>> = BTreeMap::new();
    for message in MessageStream::new(bytes).map_err(said)? {
        let message = message.map_err(said)?;
        let channel = &message.channel;
        let of_topic = |cause: String| format!("topic {}: {cause}", channel.topic);
        let decoder = match decoders.entry(channel.id) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(new) => new.insert(Decoder::of(channel).map_err(of_topic)?),
        };
        let Some(decoder) = decoder else {
            others.insert(channel.topic.clone(), encodings(channel));
            continue;
        };
        let value = decoder
            .value(&message.data)
            .map_err(|cause| format!("a message of topic {}: {cause}", channel.topic))?;
        let topic = topics.entry(channel.topic.clone()).or_default();
        let row = topic.log_time_ns.len();
        topic
            .log_time_ns
            .push(i64::try_from(message.log_time).unwrap_or(i64::MAX));
        gather("", &value, row, &mut topic.columns);
    }
    if topics.is_empty() && !others.is_empty() {
        let list: Vec<String> = others
            .iter()
            .map(|(topic, encoding)| format!("{topic} ({encoding})"))
            .collect();
        return Err(format!(
            "no topic holds messages in JSON, protobuf, or CDR of ros2msg: {}",
            list.join(", ")
        ));
    }
    // One origin for all topics: they began at different instants of one clock.
    let stamps = topics.values().flat_map(|topic| &topic.log_time_ns);
    let first_ns = stamps.copied().min().unwrap_or(0);
    let tables = topics.into_iter().map(|topic| table(topic, first_ns));
    Ok(tables.collect())
}

/// How messages, and the schema that describes them, are encoded.
fn encodings(channel: &Channel<'_>) -> String {
    let schema = channel
        .schema
        .as_deref()
        .map(|schema| schema.encoding.as_str());
    match schema.filter(|encoding| !encoding.is_empty()) {
        Some(schema) => format!("{} of {schema}", channel.message_encoding),
        None => channel.message_encoding.clone(),
    }
}

/// Puts the values of a message into a row.
fn gather(path: &str, value: &Value, row: usize, columns: &mut BTreeMap<String, Vec<String>>) {
    let number = match value {
        Value::Object(fields) => {
            for (key, value) in fields {
                gather(&below(path, '/', key), value, row, columns);
            }
            None
        }
        Value::Array(items) => {
            for (place, value) in items.iter().enumerate() {
                gather(&below(path, '/', &place.to_string()), value, row, columns);
            }
            None
        }
        Value::Bool(value) => Some(u8::from(*value).to_string()),
        Value::Number(number) => Some(number.to_string()),
        Value::String(text) => Some(text.clone()),
        Value::Null => None,
    };
    if let Some(number) = number {
        let column = columns.entry(path.into()).or_default();
        column.resize(row, String::new());
        column.push(number);
    }
}

fn table((name, topic): (String, Topic), first_ns: i64) -> Group {
    let rows = topic.log_time_ns.len();
    let seconds = topic
        .log_time_ns
        .iter()
        .map(|stamp| stamp.saturating_sub(first_ns) as f64 * 1e-9);
    let clock = Clock {
        seconds: seconds.collect(),
        says: "the log time since the file's first message".into(),
    };
    let mut log_time = Column::new("log_time", Cells::Wholes(topic.log_time_ns));
    log_time.unit = Some("ns".into());
    let columns = topic.columns.into_iter().map(|(name, mut values)| {
        values.resize(rows, String::new());
        Column::new(name, Cells::Texts(values))
    });
    Group {
        name,
        columns: columns.chain([log_time]).collect(),
        clock: Some(clock),
    }
}
