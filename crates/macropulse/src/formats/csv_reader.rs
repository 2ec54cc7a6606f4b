//! Reads points from text: a point a line, below a line of headings or without one.

use super::CloudRoom;
use super::about::About;
use super::attributes::Attribute;
use super::cloud_file::{CloudFile, LONGEST_LINE};
use super::csv::unquoted;
use super::headings::Meaning;
use super::table::{Digits, Gathered, Record, check_coordinates};
use crate::points::{NO_OBJECT, Outcome, PointCloud};
use ::csv::{ReaderBuilder, StringRecord};
use std::io::Read;

/// The meaning of the columns if no line names them. Further columns are not known.
const WITHOUT_HEADINGS: [Attribute; 4] =
    [Attribute::X, Attribute::Y, Attribute::Z, Attribute::Intensity];

/// Most columns of a text.
const MOST_COLUMNS: usize = 4096;

/// The cloud of a text, and the names in it.
///
/// Cells are apart by semicolons, tabs, commas or spaces. A cell in quotes may have these, line breaks
/// and doubled quotes. Lines that begin with `#` or `//` are comments, except for one with headings
/// before the first point. A first line with one whole number, the count of points, is passed over.
/// Columns whose headings we do not know are skipped, and an empty cell is no value. Objects and
/// materials may be names or numbers; names are numbered in the order in which they come.
pub(super) fn parse(file: &mut CloudFile, room: CloudRoom) -> Result<(PointCloud, About), String> {
    let sheet = Sheet::of(file)?.ok_or("it is empty; its first line names the columns")?;
    let points = match sheet.separator {
        Separator::Spaces => sheet.spaced(file, room),
        Separator::One(byte) => sheet.separated(byte, file, room),
    }?;
    let Points { gathered, mut about, .. } = points;
    Ok((gathered.cloud(&mut about)?, about))
}

/// The text of a line.
fn text(line: &[u8]) -> Result<&str, String> {
    std::str::from_utf8(line).map_err(|_| "it is not text in UTF-8".to_owned())
}

#[derive(Clone, Copy, PartialEq)]
enum Separator {
    Spaces,
    One(u8),
}

impl Separator {
    /// The separator of a line: the first of semicolon, tab and comma that stands there twice.
    fn of(line: &str) -> Self {
        let is_there = |byte: &u8| line.bytes().filter(|other| other == byte).count() >= 2;
        b";\t,".iter().copied().find(is_there).map_or(Self::Spaces, Self::One)
    }

    fn cells(self, line: &str) -> Box<dyn Iterator<Item = &str> + '_> {
        match self {
            Self::Spaces => Box::new(line.split_whitespace()),
            Self::One(byte) => Box::new(line.split(char::from(byte))),
        }
    }

    /// The number in a cell, whose decimal sign may be a comma where commas separate nothing.
    fn number(self, cell: &str) -> Option<f64> {
        let comma = || match self {
            Self::One(b',') => None,
            _ => cell.replacen(',', ".", 1).parse().ok(),
        };
        cell.parse().ok().or_else(comma)
    }
}

/// The place in a text at which the points or their headings begin.
struct Sheet {
    /// Lines before that.
    before: usize,
    separator: Separator,
    has_headings: bool,
}

impl Sheet {
    /// Reads up to where the points or their headings begin.
    fn of(file: &mut CloudFile) -> Result<Option<Self>, String> {
        for before in 0.. {
            let begin = file.at();
            let Some(line) = file.line()? else { break };
            let all = text(line)?;
            let line = match before {
                0 => all.trim_start_matches('\u{feff}'),
                _ => all,
            };
            let comment = line.strip_prefix('#').or_else(|| line.strip_prefix("//"));
            let bare = comment.unwrap_or(line).trim();
            let separator = Separator::of(bare);
            let cells = || separator.cells(bare).map(str::trim);
            let is_number = |cell: &str| cell.is_empty() || separator.number(cell).is_some();
            let begins = match comment {
                Some(_) => has_coordinates(cells()),
                // A count of points is one word.
                None => !bare.is_empty() && bare.parse::<u64>().is_err(),
            };
            if begins {
                let has_headings = !cells().all(is_number);
                let first = line.trim_start_matches(['#', '/']);
                let passed = all.len() - if comment.is_some() { first.len() } else { line.len() };
                file.go_to(begin + passed as u64)?;
                return Ok(Some(Self { before, separator, has_headings }));
            }
        }
        Ok(None)
    }

    /// Points whose cells are apart by spaces, and stand in no quotes.
    fn spaced(&self, file: &mut CloudFile, room: CloudRoom) -> Result<Points, String> {
        let first = file.line()?.unwrap_or_default().to_vec();
        let cells = || text(&first).map(str::split_whitespace);
        let mut points = Points::new(cells()?, self, room)?;
        if !self.has_headings {
            points.take(cells()?).map_err(|fault| format!("line {}: {fault}", self.before + 1))?;
        }
        for number in self.before + 2.. {
            let Some(line) = file.line()? else { break };
            let line = text(line)?;
            let is_comment = line.starts_with('#') || line.starts_with("//");
            if !is_comment && !line.trim().is_empty() {
                let taken = points.take(line.split_whitespace());
                taken.map_err(|fault| format!("line {number}: {fault}"))?;
            }
        }
        Ok(points)
    }

    /// Points whose cells are apart by a sign, and may stand in quotes.
    fn separated(
        &self,
        separator: u8,
        file: &mut CloudFile,
        room: CloudRoom,
    ) -> Result<Points, String> {
        let mut reader = ReaderBuilder::new()
            .delimiter(separator)
            .has_headers(false)
            .flexible(true)
            .comment(Some(b'#'))
            .from_reader(file.take(LONGEST_LINE));
        let mut record = StringRecord::new();
        let mut next = |record: &mut StringRecord| {
            // A quote that is not closed would take in all that follows.
            reader.get_mut().set_limit(LONGEST_LINE);
            let read = reader.read_record(record);
            let is_there = read.map_err(|_| "it is not text in UTF-8")?;
            let limited = reader.get_ref();
            if limited.limit() == 0 && limited.get_ref().rest() > 0 {
                return Err(format!(
                    "line {}: a quote is not closed, or a point takes more than {LONGEST_LINE} bytes",
                    self.before as u64 + record.position().map_or(0, ::csv::Position::line)
                ));
            }
            Ok(is_there)
        };
        next(&mut record)?;
        let mut points = Points::new(record.iter(), self, room)?;
        let mut is_there = if self.has_headings { next(&mut record)? } else { true };
        while is_there {
            let is_blank = record.iter().all(|cell| cell.trim().is_empty());
            if !is_blank && !record.get(0).is_some_and(|cell| cell.starts_with("//")) {
                points.take(record.iter()).map_err(|fault| {
                    let line = record.position().map_or(0, ::csv::Position::line);
                    let line = self.before as u64 + line;
                    // A quote that is not closed takes in all that follows.
                    match record.iter().any(|cell| cell.contains('\n')) {
                        true => format!("line {line}: a quote is not closed, or {fault}"),
                        false => format!("line {line}: {fault}"),
                    }
                })?;
            }
            is_there = next(&mut record)?;
        }
        Ok(points)
    }
}

/// Returns true if these headings name all three coordinates.
fn has_coordinates<'a>(headings: impl Iterator<Item = &'a str>) -> bool {
    let known = headings.filter_map(|heading| Meaning::of_heading(heading, None));
    check_coordinates(&known.map(|meaning| meaning.attribute).collect::<Vec<_>>()).is_ok()
}

/// Points that are read from cells.
struct Points {
    separator: Separator,
    columns: Vec<Option<Meaning>>,
    about: About,
    gathered: Gathered,
    /// Lines that were taken.
    taken: usize,
}

impl Points {
    /// Creates points with the columns that the cells of the first line name, or without headings with one
    /// column per cell.
    fn new<'a>(
        first: impl Iterator<Item = &'a str>,
        sheet: &Sheet,
        room: CloudRoom,
    ) -> Result<Self, String> {
        let mut columns: Vec<Option<Meaning>> = Vec::new();
        let mut attributes = Vec::new();
        let mut about = About::within(room);
        for (at, heading) in first.enumerate() {
            if at == MOST_COLUMNS {
                return Err(format!("its first line has more than {MOST_COLUMNS} cells"));
            }
            let meaning = match sheet.has_headings {
                true => Meaning::of_heading(heading.trim_matches('"'), None),
                false => WITHOUT_HEADINGS.get(at).copied().map(Meaning::of),
            };
            // The first column of an attribute counts.
            let meaning = meaning.filter(|meaning| !attributes.contains(&meaning.attribute));
            match (meaning, sheet.has_headings) {
                (Some(meaning), _) => attributes.push(meaning.attribute),
                (None, true) => about.left_out.field(heading.trim().trim_matches('"')),
                (None, false) => about.left_out.field(&format!("column {}", at + 1)),
            }
            columns.push(meaning);
        }
        check_coordinates(&attributes).map_err(|fault| {
            format!("{fault}; its first line names the columns, as `x,y,z,intensity`")
        })?;
        let gathered = Gathered::new(&about, &attributes, Digits::AsWritten)?;
        Ok(Self { separator: sheet.separator, columns, about, gathered, taken: 0 })
    }

    /// Takes in the cells of a point.
    fn take<'a>(&mut self, mut cells: impl Iterator<Item = &'a str>) -> Result<(), String> {
        let mut record = Record::default();
        for column in &self.columns {
            let cell = cells
                .next()
                .ok_or("it has fewer cells than there are columns; was the file cut short?")?;
            let Some(meaning) = *column else { continue };
            if let Some(value) = value(meaning, cell.trim(), self.separator, &mut self.about)? {
                record.set(self.taken, meaning.attribute, value)?;
            }
        }
        if cells.any(|cell| !cell.trim().is_empty()) {
            return Err("it has more cells than there are columns".to_owned());
        }
        self.gathered.add(record);
        self.taken += 1;
        self.gathered.expect(self.taken as u64)
    }
}

/// The number that a cell stands for; none for an empty one.
fn value(
    meaning: Meaning,
    cell: &str,
    separator: Separator,
    about: &mut About,
) -> Result<Option<f64>, String> {
    if cell.is_empty() {
        return Ok(None);
    }
    let number = separator.number(cell).map(|number| meaning.number(number));
    let number = match meaning.attribute {
        Attribute::Outcome => {
            let known = Outcome::ALL.into_iter().find(|outcome| outcome.name() == cell);
            known.map(|outcome| f64::from(outcome as u8)).or(number)
        }
        Attribute::Object => number.or_else(|| numbered(&mut about.objects, unquoted(cell))),
        Attribute::Material => number.or_else(|| numbered(&mut about.materials, unquoted(cell))),
        _ => number,
    };
    number.map(Some).ok_or_else(|| format!("`{cell}` is no {}", meaning.attribute.name()))
}

/// The number of a name, a new one for a new name.
fn numbered(names: &mut Vec<String>, name: &str) -> Option<f64> {
    let at = names.iter().position(|known| known == name).unwrap_or(names.len());
    if at == names.len() {
        if at >= usize::from(NO_OBJECT) {
            return None;
        }
        names.push(name.to_owned());
    }
    Some(at as f64)
}

#[cfg(test)]
mod tests {
    use super::super::format::CloudWriter;
    use super::super::{Names, csv, sample_cloud};
    use super::*;

    fn parse(bytes: &[u8]) -> Result<(PointCloud, About), String> {
        super::parse(&mut CloudFile::of_bytes(bytes), CloudRoom::default())
    }

    #[test]
    fn what_was_written_is_read() {
        let cloud = sample_cloud();
        let objects = ["=car,\nred".to_owned(), "the \"road\"".to_owned()];
        let mut bytes = Vec::new();
        csv::Csv.write(&cloud, &Names { objects: &objects, materials: &[] }, &mut bytes).unwrap();
        let (read, about) = parse(&bytes).unwrap();
        assert_eq!((read.rows, read.columns), (2, 3));
        assert_eq!((&read.range, &read.time_ns), (&cloud.range, &cloud.time_ns));
        assert_eq!(read.truth.returns.outcome, cloud.truth.returns.outcome);
        assert_eq!(read.truth.returns.object, cloud.truth.returns.object);
        assert_eq!(read.truth.returns.material, cloud.truth.returns.material);
        assert_eq!(about.objects, objects);
    }

    #[test]
    fn faults_have_their_line() {
        let fault = |text: &str| parse(text.as_bytes()).unwrap_err();
        assert_eq!(fault(""), "it is empty; its first line names the columns");
        assert!(fault("a,b\n1,2\n").starts_with("it has no field `x`; its first line names"));
        assert_eq!(fault("x,y,z\n1,2,far\n"), "line 2: `far` is no z");
        assert!(fault("x,y,z\n1,2,3\n1,2\n").starts_with("line 3: it has fewer cells"));
        assert!(fault("x,y,z\n1,2,3,4\n").starts_with("line 2: it has more cells"));
        assert!(fault("x,y,z\n1,2,\"3\n4,5,6\n").starts_with("line 2: a quote is not closed"));
        assert!(fault("x,y,z,row\n1,2,3,-1\n").contains("whole numbers from 0 to 65535"));
    }

    #[test]
    fn a_file_of_another_program_needs_x_y_and_z_alone() {
        let (read, _) = parse(b"z,name,y,x\n12,a,4,3\n\n").unwrap();
        assert_eq!((&*read.distances(), read.rows), (&[13.0][..], 0));
        assert!(read.range.is_empty() && read.time_ns.is_empty() && read.intensity.is_empty());
    }

    #[test]
    fn digits_beyond_those_of_a_float_are_kept() {
        let far = b"x,y,z,range_m\n494428.61,4877455.58,123.456,30.02\n1,2,3,4\n";
        let (read, about) = parse(far).unwrap();
        assert_eq!(read.position(0), [494_428.61, 4_877_455.58, 123.456]);
        assert!(read.exact.range.is_empty() && about.left_out.is_empty());
        let (read, _) = parse(b"x,y,z\n0.1,30.02,-5e-3\n").unwrap();
        assert!(read.exact.x.is_empty());
        assert_eq!((read.x[0], read.y[0], read.z[0]), (0.1, 30.02, -5e-3));
    }

    #[test]
    fn usual_headings_and_separators_are_read() {
        for text in [
            "X;Y;Z;I\r\n3;4;12;0,5\r\n\r\n0;0;2,5;1\r\n",
            "\u{feff}\"x [m]\",\"y [m]\",\"z [m]\",Intensity\n3,4,12,0.5\n0,0,2.5,1,\n",
            "Points:0\tPoints:1\tPoints:2\tscalar_Intensity\n3\t4\t12\t.5\n0\t0\t2.5\t1\n",
            "# made by hand\nx,y,z,label,Reflectivity\n# and a comment\n3,4,12,\"a, \"\"b\"\"\nc\",0.5\n\
             0,0,2.5,,1\n",
            "//X Y Z R Intensity\n3 4 12 255 0.5\n  0   0 2.5 9 1\n",
            "// scan\n3 4 12 0.5\n# mark\n0 0 2.5 1\n",
            "2\n3 4 12 0.5 9 9 9\n0 0 2.5 1 9 9 9\n",
            "3,4,12,0.5\n// far\n0,0,2.5,1\n",
        ] {
            let (read, _) =
                parse(text.as_bytes()).unwrap_or_else(|fault| panic!("{text}: {fault}"));
            assert_eq!(
                (&*read.distances(), &read.intensity[..]),
                (&[13.0, 2.5][..], &[0.5, 1.0][..])
            );
        }
    }

    #[test]
    fn times_are_in_the_unit_of_their_heading_or_in_seconds() {
        let time = |heading: &str, cell: &str| {
            let text = format!("x,y,z,{heading}\n1,2,2,{cell}\n");
            parse(text.as_bytes()).unwrap().0.time_ns[0]
        };
        assert_eq!(time("timestamp", "12.5"), 12.5e9);
        assert_eq!(time("gps_time", "1.5"), 1.5e9);
        assert_eq!(time("Time [us]", "1.5"), 1500.0);
        assert_eq!(time("time_ns", "1.5"), 1.5);
    }

    #[test]
    fn a_line_break_in_quotes_keeps_the_count_of_lines() {
        let text = "name,x,y,z\n\"two\nlines\",1,2,3\n\"more\nof them\",1,2,far\n";
        let told = parse(text.as_bytes()).unwrap_err();
        assert!(told.starts_with("line 4: a quote is not closed, or `far` is no z"), "{told}");
    }
}
