//! A sensor file as typed: unit-suffixed keys, nothing checked yet but names and types.

use serde::Deserialize;

use super::detector::DetectorFile;
use super::light::LightFile;
use super::scan::ScanFile;
use macropulse_codec::decode::{Effort, Pick};

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SensorFile {
    pub version: u32,
    pub name: String,
    #[serde(default)]
    pub summary: String,
    pub idealised: Vec<String>,
    pub scan: ScanFile,
    pub light: LightFile,
    pub code: Option<CodeFile>,
    pub detector: DetectorFile,
    pub optics: Option<OpticsFile>,
    pub safety: Option<SafetyFile>,
    pub tdc: TdcFile,
    pub receiver: ReceiverFile,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct OpticsFile {
    pub aperture_mm: f64,
    pub transmission: f64,
    pub filter_nm: f64,
    pub field: FieldFile,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) enum FieldFile {
    #[serde(rename = "staring")]
    Staring,
    #[serde(rename = "descanned")]
    Descanned,
    #[serde(rename = "in-flight")]
    InFlight,
    #[serde(rename = "trailing_pixels")]
    TrailingPixels(f64),
    #[serde(rename = "cone_mrad")]
    ConeMrad(f64),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SafetyFile {
    pub distance_mm: f64,
    pub count_lines: bool,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CodeFile {
    pub family: FamilyFile,
    pub chip_ps: f64,
    pub keying: KeyingFile,
    pub label: Label,
    pub label_bits: u32,
    pub crc: CrcFile,
    pub sync_bit: bool,
    pub allow_dark: bool,
    pub word: WordFile,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum FamilyFile {
    Prime(u32),
    ExtendedPrime(u32),
    QuadraticCongruence(u32),
    ExtendedQuadraticCongruence(u32),
    Orthogonal(OrthogonalFile),
    Sparse(SparseFile),
    MSequence(u32),
    Gold(u32),
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct OrthogonalFile {
    pub length: u32,
    pub weight: u32,
    pub words: Option<u32>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SparseFile {
    pub length: u32,
    pub weight: u32,
    pub words: u32,
    pub seed: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum KeyingFile {
    OnOff,
    Inversion,
}

/// Which number a macropulse carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Label {
    /// The column of its pixel.
    Column,
    /// None: a macropulse is one bare code word.
    None,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CrcFile {
    pub width: u8,
    pub polynomial: u8,
    pub init: u8,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WordFile {
    pub first: u32,
    pub modulus: u32,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TdcFile {
    pub converters: u32,
    pub resolution_ps: f64,
    pub clock_ps: f64,
    pub bits: u32,
    pub dead_time_ns: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ReceiverFile {
    pub kind: ReceiverKindFile,
    pub effort: Effort,
    pub false_alarm: f64,
    pub bit_threshold: u32,
    pub right_within_m: Option<f64>,
    pub returns: u32,
    pub pick: Option<Pick>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum ReceiverKindFile {
    Literal,
    Blind,
    Matched,
    Balanced,
    Direct,
}
