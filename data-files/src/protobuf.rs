//! Messages of protobuf as values, by the descriptors that the file holds; `prost-reflect` decodes.

use prost_reflect::{
    DescriptorPool, DynamicMessage, MapKey, MessageDescriptor, ReflectMessage, Value as Field,
};
use serde_json::{Map, Value};

use crate::said;
use crate::values::{double, single};

/// What messages of a schema are decoded by.
pub(crate) struct Decoder(MessageDescriptor);

impl Decoder {
    /// Of the message `name` in a serialised set of file descriptors.
    pub(crate) fn new(name: &str, descriptors: &[u8]) -> Result<Self, String> {
        let pool = DescriptorPool::decode(descriptors).map_err(said)?;
        let message = pool.get_message_by_name(name);
        let missing = || format!("its descriptors hold no message {name}");
        message.map(Self).ok_or_else(missing)
    }

    /// A message as a value.
    pub(crate) fn value(&self, bytes: &[u8]) -> Result<Value, String> {
        let message = DynamicMessage::decode(self.0.clone(), bytes).map_err(said)?;
        Ok(of_message(&message))
    }
}

/// All fields: one that is at its default is not sent, and is that number.
fn of_message(message: &DynamicMessage) -> Value {
    let descriptor = message.descriptor();
    let fields = descriptor.fields().filter_map(|field| {
        let is_there = message.has_field(&field) || !field.supports_presence();
        let value = is_there.then(|| of_field(&message.get_field(&field)))?;
        Some((field.name().to_owned(), value))
    });
    Value::Object(fields.collect())
}

fn of_field(field: &Field) -> Value {
    match field {
        Field::Bool(value) => (*value).into(),
        Field::I32(value) | Field::EnumNumber(value) => (*value).into(),
        Field::I64(value) => (*value).into(),
        Field::U32(value) => (*value).into(),
        Field::U64(value) => (*value).into(),
        Field::F32(value) => single(*value),
        Field::F64(value) => double(*value),
        Field::String(text) => text.clone().into(),
        Field::Bytes(_) => Value::Null,
        Field::Message(message) => of_message(message),
        Field::List(items) => items.iter().map(of_field).collect(),
        Field::Map(entries) => {
            let entries = entries
                .iter()
                .map(|(key, value)| (key_text(key), of_field(value)));
            Value::Object(entries.collect::<Map<String, Value>>())
        }
    }
}

fn key_text(key: &MapKey) -> String {
    match key {
        MapKey::Bool(key) => key.to_string(),
        MapKey::I32(key) => key.to_string(),
        MapKey::I64(key) => key.to_string(),
        MapKey::U32(key) => key.to_string(),
        MapKey::U64(key) => key.to_string(),
        MapKey::String(key) => key.clone(),
    }
}
