//! Messages of ROS 2 as values: CDR, by the message definitions (`ros2msg`) that the file holds.
//!
//! Definitions: design.ros2.org, "Interface definition using .msg files"; several, separated by a line
//! of `=`, each after the first headed `MSG: package/Name`. Encoding: OMG DDS-RTPS 2.5, section 10, plain
//! CDR of either byte order: a number lies at a multiple of its length, counted from behind the four
//! bytes of the header; texts and sequences begin with their length; a message without fields is a byte.

use serde_json::{Map, Value};

use crate::values::{double, single};

/// Messages within messages at the most: a definition may name itself.
const DEEPEST: u32 = 32;

#[derive(Clone, Debug, PartialEq)]
enum Kind {
    Bool,
    Signed(usize),
    Unsigned(usize),
    Single,
    Double,
    Text,
    /// Another message, by its place.
    Message(usize),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Count {
    One,
    Fixed(usize),
    Counted,
}

#[derive(Clone, Debug)]
struct Field {
    name: String,
    kind: Kind,
    count: Count,
}

/// What messages of a schema are decoded by: the first message is the schema's own.
#[derive(Debug)]
pub(crate) struct Decoder {
    messages: Vec<Vec<Field>>,
}

/// A message of the definitions: its name, and its lines.
type Defined<'t> = (String, Vec<&'t str>);

impl Decoder {
    /// Of the message `name`, whose definitions these are.
    pub(crate) fn new(name: &str, definitions: &[u8]) -> Result<Self, String> {
        let text = std::str::from_utf8(definitions).map_err(crate::said)?;
        let defined = split(name, text);
        let names: Vec<&str> = defined.iter().map(|(name, _)| name.as_str()).collect();
        let messages = defined.iter().map(|(own, lines)| {
            let fields = lines
                .iter()
                .filter_map(|line| field(own, line, &names).transpose());
            fields.collect::<Result<Vec<Field>, String>>()
        });
        Ok(Self {
            messages: messages.collect::<Result<_, String>>()?,
        })
    }

    /// A message as a value.
    pub(crate) fn value(&self, bytes: &[u8]) -> Result<Value, String> {
        let header: [u8; 4] = bytes
            .get(..4)
            .and_then(|header| header.try_into().ok())
            .ok_or("it ends before its header does")?;
        let is_little = match header {
            [0, 0, ..] => false,
            [0, 1, ..] => true,
            [high, low, ..] => {
                let id = u16::from_be_bytes([high, low]);
                return Err(format!("encapsulation {id:#06x}, expected plain CDR"));
            }
        };
        let mut cursor = Cursor {
            bytes: &bytes[4..],
            at: 0,
            is_little,
        };
        self.message(0, &mut cursor, 0)
    }

    fn message(&self, place: usize, cursor: &mut Cursor<'_>, depth: u32) -> Result<Value, String> {
        let fields = &self.messages[place];
        if depth > DEEPEST {
            return Err(format!("messages within messages more than {DEEPEST} deep"));
        }
        if fields.is_empty() {
            cursor.take(1)?;
        }
        let mut values = Map::new();
        for field in fields {
            let value = match field.count {
                Count::One => self.one(&field.kind, cursor, depth)?,
                Count::Fixed(count) => self.several(&field.kind, count, cursor, depth)?,
                Count::Counted => {
                    let count = cursor.length()?;
                    self.several(&field.kind, count, cursor, depth)?
                }
            };
            values.insert(field.name.clone(), value);
        }
        Ok(Value::Object(values))
    }

    /// So many of a kind: each takes a byte at least, so that a false count ends with the bytes.
    fn several(
        &self,
        kind: &Kind,
        count: usize,
        cursor: &mut Cursor<'_>,
        depth: u32,
    ) -> Result<Value, String> {
        let items = (0..count).map(|_| self.one(kind, cursor, depth));
        items
            .collect::<Result<Vec<Value>, String>>()
            .map(Value::Array)
    }

    fn one(&self, kind: &Kind, cursor: &mut Cursor<'_>, depth: u32) -> Result<Value, String> {
        Ok(match *kind {
            Kind::Bool => (cursor.whole(1)? != 0).into(),
            Kind::Unsigned(length) => cursor.whole(length)?.into(),
            Kind::Signed(length) => {
                let unused = 64 - 8 * length as u32;
                // The sign moves to the highest bit and back.
                ((cursor.whole(length)? << unused) as i64 >> unused).into()
            }
            Kind::Single => single(f32::from_bits(cursor.whole(4)? as u32)),
            Kind::Double => double(f64::from_bits(cursor.whole(8)?)),
            Kind::Text => cursor.text()?.into(),
            Kind::Message(place) => self.message(place, cursor, depth + 1)?,
        })
    }
}

struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    is_little: bool,
}

impl<'a> Cursor<'a> {
    fn take(&mut self, length: usize) -> Result<&'a [u8], String> {
        let end = self.at.checked_add(length);
        let taken = end.and_then(|end| self.bytes.get(self.at..end));
        self.at = self.at.saturating_add(length);
        taken.ok_or_else(|| "it ends before its last field".into())
    }

    /// A number of so many bytes, at the next multiple of its length.
    fn whole(&mut self, length: usize) -> Result<u64, String> {
        self.at = self.at.next_multiple_of(length);
        let bytes = self.take(length)?;
        let digits = bytes.iter().map(|byte| u64::from(*byte));
        let sum = |sum: u64, digit: u64| sum << 8 | digit;
        Ok(if self.is_little {
            digits.rev().fold(0, sum)
        } else {
            digits.fold(0, sum)
        })
    }

    fn length(&mut self) -> Result<usize, String> {
        usize::try_from(self.whole(4)?).map_err(crate::said)
    }

    /// A text, without the zero that ends it.
    fn text(&mut self) -> Result<String, String> {
        let length = self.length()?;
        let bytes = self.take(length)?;
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        Ok(String::from_utf8_lossy(bytes).into_owned())
    }
}

/// The messages of the definitions: the schema's own first.
fn split<'t>(name: &str, text: &'t str) -> Vec<Defined<'t>> {
    let mut all: Vec<Defined<'t>> = vec![(plain(name), Vec::new())];
    let mut is_head = false;
    for line in text.lines() {
        let line = line.split('#').next().unwrap_or_default().trim();
        if !line.is_empty() && line.chars().all(|c| c == '=') {
            is_head = true;
        } else if let Some(name) = line.strip_prefix("MSG:").filter(|_| is_head) {
            all.push((plain(name.trim()), Vec::new()));
            is_head = false;
        } else if let Some((_, lines)) = all.last_mut().filter(|_| !line.is_empty()) {
            lines.push(line);
        }
    }
    all
}

/// `package/msg/Name` is `package/Name`.
fn plain(name: &str) -> String {
    name.replace("/msg/", "/")
}

/// `float64[3] position`, `std_msgs/Header header`; constants are no fields.
fn field(own: &str, line: &str, names: &[&str]) -> Result<Option<Field>, String> {
    let mut words = line.split_whitespace();
    let (Some(kind), Some(name)) = (words.next(), words.next()) else {
        return Err(format!("the definition {line:?} is no field"));
    };
    let is_constant = name.contains('=') || words.next().is_some_and(|next| next.starts_with('='));
    if is_constant {
        return Ok(None);
    }
    let (kind, count) = counted(kind)?;
    // `string<=32`: a longer one is never sent.
    let kind = kind.split("<=").next().unwrap_or(kind);
    Ok(Some(Field {
        name: name.to_owned(),
        kind: of_kind(own, kind, names)?,
        count,
    }))
}

/// The kind of the items, and how many there are.
fn counted(kind: &str) -> Result<(&str, Count), String> {
    let Some((items, count)) = kind
        .strip_suffix(']')
        .and_then(|kind| kind.rsplit_once('['))
    else {
        return Ok((kind, Count::One));
    };
    if count.is_empty() || count.starts_with("<=") {
        return Ok((items, Count::Counted));
    }
    let number = count.parse().map(Count::Fixed);
    Ok((
        items,
        number.map_err(|_| format!("the definition has an array of {count}"))?,
    ))
}

fn of_kind(own: &str, kind: &str, names: &[&str]) -> Result<Kind, String> {
    Ok(match kind {
        "bool" => Kind::Bool,
        "byte" | "char" | "uint8" => Kind::Unsigned(1),
        "int8" => Kind::Signed(1),
        "uint16" => Kind::Unsigned(2),
        "int16" => Kind::Signed(2),
        "uint32" => Kind::Unsigned(4),
        "int32" => Kind::Signed(4),
        "uint64" => Kind::Unsigned(8),
        "int64" => Kind::Signed(8),
        "float32" => Kind::Single,
        "float64" => Kind::Double,
        "string" => Kind::Text,
        other => {
            let whole = plain(other);
            let package = own.split('/').next().unwrap_or_default();
            let beside = format!("{package}/{whole}");
            let candidates = [whole.clone(), beside, format!("std_msgs/{whole}")];
            let place = candidates
                .iter()
                .find_map(|name| names.iter().position(|one| one == name));
            let unknown = || format!("the definitions have no message {other}");
            Kind::Message(place.ok_or_else(unknown)?)
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    const AXIS: &str = "std_msgs/Header header\nfloat64 x   # position\nfloat32[2] p\nint16[] codes\n\
                        uint8 IDLE=1\nstring name\nbool moves\nEmpty none\n\
                        ================\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
                        ====\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n\
                        ====\nMSG: rig/Empty\n";

    /// The bytes by hand, after the rules of the standard.
    fn bytes() -> Vec<u8> {
        let mut bytes = vec![0, 1, 0, 0];
        bytes.extend((-5_i32).to_le_bytes());
        bytes.extend(7_u32.to_le_bytes());
        bytes.extend([3, 0, 0, 0, b'a', b'b', 0]);
        bytes.push(0); // to a multiple of 8
        bytes.extend(0.25_f64.to_le_bytes());
        bytes.extend(0.1_f32.to_le_bytes());
        bytes.extend(f32::NAN.to_le_bytes());
        bytes.extend(2_u32.to_le_bytes());
        bytes.extend((-2_i16).to_le_bytes());
        bytes.extend(9_i16.to_le_bytes());
        bytes.extend([1, 0, 0, 0, 0, 1, 0]);
        bytes
    }

    #[test]
    fn val_a_message_is_read_as_the_standard_lays_it_out() {
        let decoder = Decoder::new("rig/msg/Axis", AXIS.as_bytes()).unwrap();
        let expected = json!({
            "header": { "stamp": { "sec": -5, "nanosec": 7 }, "frame_id": "ab" },
            "x": 0.25, "p": [0.1, "NaN"], "codes": [-2, 9], "name": "", "moves": true, "none": {},
        });
        assert_eq!(decoder.value(&bytes()).unwrap(), expected);
    }

    #[test]
    fn prop_what_is_cut_or_false_is_refused() {
        let decoder = Decoder::new("rig/Axis", AXIS.as_bytes()).unwrap();
        let whole = bytes();
        for length in 0..whole.len() {
            assert!(decoder.value(&whole[..length]).is_err(), "{length}");
        }
        let mut endless = whole.clone();
        endless[36..40].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(decoder.value(&endless).is_err());
        let mut other = whole;
        other[1] = 7;
        assert!(decoder.value(&other).unwrap_err().contains("plain CDR"));
        for wrong in ["wstring name", "float64", "float64[x] a", "Nowhere b"] {
            assert!(
                Decoder::new("rig/Axis", wrong.as_bytes()).is_err(),
                "{wrong}"
            );
        }
        let itself = Decoder::new("rig/Axis", b"Axis inner\n").unwrap();
        assert!(itself.value(&[0, 1, 0, 0]).unwrap_err().contains("deep"));
    }
}
