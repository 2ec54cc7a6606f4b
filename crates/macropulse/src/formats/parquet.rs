//! Apache Parquet: a column for each attribute, a row for each return.

use super::Names;
use super::about::all_lines;
use super::attributes::{Attribute, Value, returns};
use super::format::CloudWriter;
use super::holding::Further;
use super::number::Kind;
use crate::points::PointCloud;
use ::parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use ::parquet::data_type::{DataType, DoubleType, FloatType, Int32Type};
use ::parquet::errors::Result;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use ::parquet::schema::types::{Type, TypePtr};
use std::io::{self, Write};
use std::sync::Arc;

/// Key of the text with scan, image, pose and names.
const KEY: &str = "macropulse";

/// Apache Parquet.
pub(super) struct Parquet;

impl CloudWriter for Parquet {
    fn name(&self) -> &'static str {
        "parquet"
    }

    fn holds_further(&self, further: Further) -> bool {
        further != Further::EmptyPixels
    }

    fn write(&self, cloud: &PointCloud, names: &Names, out: &mut dyn Write) -> io::Result<()> {
        let written = encode(cloud, names).map_err(io::Error::other)?;
        out.write_all(&written)
    }
}

fn encode(cloud: &PointCloud, names: &Names) -> Result<Vec<u8>> {
    let attributes = Attribute::of(cloud);
    let fields: Result<Vec<TypePtr>> =
        attributes.iter().map(|attribute| field(*attribute, cloud)).collect();
    let schema = Type::group_type_builder("points").with_fields(fields?).build()?;
    let lines = all_lines(cloud, names).collect::<Vec<_>>().join("\n");
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by(concat!("macropulse ", env!("CARGO_PKG_VERSION")).to_owned())
        .set_key_value_metadata(Some(vec![KeyValue::new(KEY.to_owned(), lines)]))
        .build();
    let mut writer = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties))?;
    let mut rows = writer.next_row_group()?;
    for attribute in attributes {
        let Some(mut column) = rows.next_column()? else { break };
        let values = returns(cloud).map(|point| attribute.value(cloud, point));
        match attribute.kind(cloud) {
            Kind::F4 => put::<FloatType>(&mut column, values.map(|value| value.number() as f32)),
            Kind::F8 => put::<DoubleType>(&mut column, values.map(Value::number)),
            _ => put::<Int32Type>(&mut column, values.map(|value| value.number() as i32)),
        }?;
        column.close()?;
    }
    rows.close()?;
    writer.into_inner()
}

fn put<T: DataType>(
    column: &mut SerializedColumnWriter,
    values: impl Iterator<Item = T::T>,
) -> Result<()> {
    let values: Vec<T::T> = values.collect();
    column.typed::<T>().write_batch(&values, None, None).map(|_| ())
}

fn field(attribute: Attribute, cloud: &PointCloud) -> Result<TypePtr> {
    let unsigned = |bit_width| Some(LogicalType::integer(bit_width, false));
    let (physical, logical) = match attribute.kind(cloud) {
        Kind::F4 => (Physical::FLOAT, None),
        Kind::F8 => (Physical::DOUBLE, None),
        Kind::U1 => (Physical::INT32, unsigned(8)),
        _ => (Physical::INT32, unsigned(16)),
    };
    Type::primitive_type_builder(attribute.name(), physical)
        .with_repetition(Repetition::REQUIRED)
        .with_logical_type(logical)
        .build()
        .map(Arc::new)
}

#[cfg(test)]
mod tests {
    use super::super::sample_cloud;
    use super::*;
    use ::parquet::file::reader::{FileReader, SerializedFileReader};

    #[test]
    fn every_attribute_is_a_column() {
        let cloud = sample_cloud();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scan.parquet");
        std::fs::write(&path, encode(&cloud, &Names::default()).unwrap()).unwrap();
        let file = SerializedFileReader::new(std::fs::File::open(path).unwrap()).unwrap();
        let rows: Vec<_> = file.get_row_iter(None).unwrap().map(Result::unwrap).collect();
        assert_eq!(rows.len(), cloud.returns());
        let names: Vec<String> = rows[0].get_column_iter().map(|(name, _)| name.clone()).collect();
        let expected: Vec<&str> = Attribute::of(&cloud).iter().map(|known| known.name()).collect();
        assert_eq!(names, expected);
        assert_eq!(rows[2].get_column_iter().next().unwrap().1.to_string(), "29.0");
    }
}
