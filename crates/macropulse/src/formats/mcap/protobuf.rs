//! Descriptions of protobuf messages, which MCAP keeps beside the messages: those fields that we write,
//! under the numbers that their publishers gave them.

use prost::Message as _;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{
    DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto,
    FileDescriptorProto, FileDescriptorSet,
};

/// Type of a field.
#[derive(Clone, Copy)]
pub(super) enum Of {
    F8,
    U4,
    U8,
    I8,
    I4,
    Fixed4,
    Text,
    Bytes,
    /// An enumeration within the same message, by its full name, and its values from 0.
    Choice(&'static str, &'static [&'static str]),
    /// An enumeration of its package, by its full name.
    Kind(&'static str),
    /// A message by its full name.
    Message(&'static str),
    /// Any number of a message.
    Many(&'static str),
}

/// A field: its name, its number, its type.
pub(super) type Field = (&'static str, i32, Of);

/// A message: its name, its fields.
pub(super) type Described = (&'static str, &'static [Field]);

/// An enumeration: its full name, and its values from 0.
pub(super) type Choices = (&'static str, &'static [&'static str]);

/// A file of messages.
pub(super) struct Package {
    pub file: &'static str,
    pub package: &'static str,
    pub syntax: &'static str,
    pub imports: &'static [&'static str],
    pub messages: &'static [Described],
    /// Enumerations that stand beside the messages.
    pub choices: &'static [Choices],
}

/// A set of descriptions, in the order in which one needs the other, encoded.
pub(super) fn descriptor_set(packages: &[Package]) -> Vec<u8> {
    FileDescriptorSet { file: packages.iter().map(file).collect() }.encode_to_vec()
}

fn file(package: &Package) -> FileDescriptorProto {
    FileDescriptorProto {
        name: Some(package.file.to_owned()),
        package: Some(package.package.to_owned()),
        dependency: package.imports.iter().map(|import| (*import).to_owned()).collect(),
        message_type: package.messages.iter().map(message).collect(),
        enum_type: package.choices.iter().map(enumeration).collect(),
        syntax: Some(package.syntax.to_owned()),
        ..FileDescriptorProto::default()
    }
}

fn message((name, fields): &Described) -> DescriptorProto {
    DescriptorProto {
        name: Some((*name).to_owned()),
        field: fields.iter().map(field).collect(),
        enum_type: fields
            .iter()
            .filter_map(|(_, _, of)| match of {
                Of::Choice(name, values) => Some(enumeration(&(name, values))),
                _ => None,
            })
            .collect(),
        ..DescriptorProto::default()
    }
}

fn enumeration((name, values): &Choices) -> EnumDescriptorProto {
    let value = |(number, name): (usize, &&str)| EnumValueDescriptorProto {
        name: Some((*name).to_owned()),
        number: Some(number as i32),
        ..EnumValueDescriptorProto::default()
    };
    EnumDescriptorProto {
        name: name.rsplit('.').next().map(str::to_owned),
        value: values.iter().enumerate().map(value).collect(),
        ..EnumDescriptorProto::default()
    }
}

fn field(&(name, number, of): &Field) -> FieldDescriptorProto {
    let (kind, type_name) = match of {
        Of::F8 => (Type::Double, None),
        Of::U4 => (Type::Uint32, None),
        Of::U8 => (Type::Uint64, None),
        Of::I8 => (Type::Int64, None),
        Of::I4 => (Type::Int32, None),
        Of::Fixed4 => (Type::Fixed32, None),
        Of::Text => (Type::String, None),
        Of::Bytes => (Type::Bytes, None),
        Of::Choice(name, _) | Of::Kind(name) => (Type::Enum, Some(name.to_owned())),
        Of::Message(name) | Of::Many(name) => (Type::Message, Some(name.to_owned())),
    };
    let label = if matches!(of, Of::Many(_)) { Label::Repeated } else { Label::Optional };
    FieldDescriptorProto {
        name: Some(name.to_owned()),
        number: Some(number),
        label: Some(label as i32),
        r#type: Some(kind as i32),
        type_name,
        ..FieldDescriptorProto::default()
    }
}
