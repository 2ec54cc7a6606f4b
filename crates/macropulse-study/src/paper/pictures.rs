//! The figures of the report.

use super::Error;
use super::experiment::{DISTANCES, SENSORS, Trial};
use super::geometry::{elevations, pitch};
use super::receivers::{Comparison, RECEIVERS};
use crate::view::{
    AmplitudePicture, Axis, BitPicture, Chart, CloudPicture, Crop, Figure, Flight, Hue, Lane,
    Layout, Line, Note, RangePicture, ScaleBar, Span, Style, Timeline, Viewpoint,
};
use macropulse::codec::code::CodeWord;
use macropulse::codec::decode::ReceiverKind;
use macropulse::design::Design;
use macropulse::emit::{bands, shot_of_pixel};
use macropulse::points::Outcome;
use macropulse::units::{s_from_fs, tof_from_range};

/// Width of a range image, px.
const WIDTH: usize = 560;

/// Area shown around the car, m: half the width, height above and below the horizon.
const AROUND: (f64, f64, f64) = (2.4, 0.3, 2.9);

/// Table 2 as a picture: the chips of every code word, one line each.
pub(super) fn code_words(words: &[CodeWord]) -> Result<Figure, Error> {
    let columns = words.first().map_or(1, |word| word.length as usize);
    let mut chips = vec![f32::NAN; words.len() * columns];
    for (row, word) in words.iter().enumerate() {
        word.marks.iter().for_each(|&mark| chips[row * columns + usize::from(mark)] = 1.0);
    }
    let mut layout = Layout::new(words.len(), columns);
    layout.zoom = [1, 8];
    let png = AmplitudePicture { layout, amplitude: &chips, white: 1.0 }.png()?;
    Ok(Figure::png(
        png,
        "29 lines of 841 chips, 29 of them lit in each",
        "**Table 2.** The code words C\u{2080} (top) to C\u{2082}\u{2088}: every lit chip is a \
         micropulse. All begin with a mark; C\u{2080} repeats itself every 29 chips.",
    ))
}

/// Fig. 4: the payload of a column and its chips.
pub(super) fn payload(design: &Design, (row, column): (u16, u16)) -> Option<Figure> {
    let codebook = &design.emission.coding().codebook;
    let payload = codebook.payload()?;
    let word = shot_of_pixel(design, 0, row.into(), column.into())?.word;
    let text = payload.text(column);
    let bits: Vec<bool> = text.chars().map(|bit| bit == '1').collect();
    let marks: Vec<u32> = codebook.word(word).marks.iter().map(|&mark| u32::from(mark)).collect();
    let svg = BitPicture {
        title: format!("Payload and chips of pixel {row}, {column}"),
        bits: &bits,
        checksum_bits: usize::from(payload.crc().width),
        word: format!("C{word}"),
        word_length: codebook.word(word).length,
        marks: &marks,
        width: 960.0,
    }
    .svg();
    Some(Figure::svg(
        &svg,
        &format!(
            "**Fig. 4.** Row {row}, column {column}: label {column} and checksum make the stream \
             `{text}`; every 1 bit becomes the {} chips of code word C{word}, every 0 bit stays \
             dark. {} marks in {} chips.",
            codebook.word(word).length,
            codebook.marks(column, word).len(),
            codebook.chips()
        ),
    ))
}

/// Fig. 2: shots and echoes over time, taken from a real line of the scan of `trial`.
pub(super) fn timeline(design: &Design, trial: &Trial, row: usize) -> Figure {
    const SHOWN_NS: f64 = 520.0;
    let columns = trial.cloud.columns;
    let image = trial.cloud.image(trial.cloud.pick);
    let first = columns / 2 - 6;
    let line = bands(design, 0)
        .map(|band| band.shot_log(design))
        .find(|log| log.owned.clone().any(|shot| usize::from(log.row[shot]) == row));
    let macropulse = design.derived().macropulse * 1e9;
    let (mut sent, mut received, mut flights) = (Vec::new(), Vec::new(), Vec::new());
    if let Some(log) = line {
        let shots: Vec<usize> = log
            .owned
            .clone()
            .filter(|&s| usize::from(log.row[s]) == row && usize::from(log.column[s]) >= first)
            .collect();
        let epoch = shots.first().map_or(0, |&shot| log.fired_at_fs[shot]);
        for &shot in &shots {
            let start = s_from_fs(log.fired_at_fs[shot] - epoch) * 1e9;
            if start > SHOWN_NS {
                break;
            }
            let hue = Hue::ALL[sent.len() % 6];
            let span = |start: f64| Span {
                start,
                end: start + macropulse,
                label: log.column[shot].to_string(),
                hue,
                hollow: false,
            };
            sent.push(span(start));
            let returned = image.get(row * columns + usize::from(log.column[shot]));
            let range = returned.map_or(f64::NAN, |at| f64::from(trial.cloud.range[at]));
            let arrival = start + tof_from_range(range) * 1e9;
            if arrival < SHOWN_NS {
                received.push(span(arrival));
                flights.push(Flight { from: (0, start), to: (1, arrival), hue });
            }
        }
    }
    let svg = Timeline {
        title: "Shots and echoes in flight".into(),
        lanes: vec![
            Lane { label: "sent".into(), spans: sent },
            Lane { label: "received".into(), spans: received },
        ],
        flights,
        window: [0.0, SHOWN_NS],
        width: 960.0,
    }
    .svg();
    Figure::svg(
        &svg,
        &format!(
            "**Fig. 2.** Row {row} of the scan at {} m, from column {first}: the sensor fires a \
             macropulse every 40.9 ns, and the first echo comes when five more are under way. \
             Numbers are columns; the colours repeat.",
            trial.distance
        ),
    )
}

/// Figs. 8–11: the three sensors side by side at one distance, same window, same colours.
pub(super) fn range_images(
    designs: &[Design],
    trials: &[Trial],
    distance: u32,
) -> Result<Vec<Figure>, Error> {
    let mut figures = Vec::new();
    for (design, sensor) in designs.iter().zip(SENSORS) {
        let trial = trials.iter().find(|t| t.sensor == sensor && t.distance == distance);
        let Some(trial) = trial else { continue };
        let away = f64::from(distance);
        let (crop, pitch) = window(design, away);
        let mut layout = Layout::new(trial.cloud.rows, trial.cloud.columns);
        layout.crop = Some(crop);
        layout.scale_bar = Some(ScaleBar::at_range(1.0, away, pitch[0]));
        let layout = layout.fit(pitch, WIDTH);
        let png = RangePicture {
            layout,
            range: &trial.cloud.image(trial.cloud.pick).spread(&trial.cloud.range, f32::NAN),
            near: (away - 1.0) as f32,
            far: (away + 7.0) as f32,
        }
        .png()?;
        let points = trial.score.points_on_target;
        figures.push(Figure::png(
            png,
            &format!("range image of {sensor} at {distance} m"),
            &format!("`{sensor}`, {distance} m: **{points}** points on the car"),
        ));
    }
    Ok(figures)
}

/// Rows and columns around the car, and the angles between them.
fn window(design: &Design, away: f64) -> (Crop, [f64; 2]) {
    let columns = f64::from(design.scan.columns);
    let (side, above, below) = (AROUND.0 / away, AROUND.1 / away, AROUND.2 / away);
    let to = |value: f64, end: f64| value.round().clamp(0.0, end) as usize;
    let elevations = elevations(design);
    let pitch = pitch(design, above);
    let column = |azimuth: f64| to(columns / 2.0 - azimuth / pitch[0], columns);
    let row = |elevation: f64| elevations.partition_point(|&e| e > elevation);
    let rows = row(above)..row(-below).max(row(above) + 1);
    (Crop { rows, columns: column(side)..column(-side) }, pitch)
}

/// The points on and around the car, seen from above and aside.
pub(super) fn cloud(trial: &Trial) -> Result<Figure, Error> {
    let away = f64::from(trial.distance);
    let png = CloudPicture {
        points: [&trial.cloud.x, &trial.cloud.y, &trial.cloud.z],
        range: &trial.cloud.range,
        ends: [(away - 1.0) as f32, (away + 7.0) as f32],
        viewpoint: Viewpoint {
            eye: [away - 7.0, 4.5, 1.2],
            target: [away + 1.5, 0.0, -1.6],
            field: 0.75,
        },
        size: [WIDTH, 360],
        dot: 3,
    }
    .png()?;
    Ok(Figure::png(
        png,
        &format!("point cloud of {} at {} m", trial.sensor, trial.distance),
        &format!("`{}`, {} m, the same points seen from aside", trial.sensor, trial.distance),
    ))
}

/// Table 4 as a chart.
pub(super) fn counts(trials: &[Trial]) -> Figure {
    let x = Axis::linear("distance of the car, m").limits(20.0, 130.0);
    let mut chart = Chart::new("Samples and points on the car", x, Axis::log("number on the car"));
    for (at, sensor) in SENSORS.iter().enumerate() {
        let of = |value: &dyn Fn(&Trial) -> f64| -> Vec<[f64; 2]> {
            let own = trials.iter().filter(|t| t.sensor == *sensor);
            own.map(|t| [f64::from(t.distance), value(t)]).filter(|p| p[1] > 0.0).collect()
        };
        let hue = Hue::ALL[at];
        chart = chart
            .series(
                &format!("{sensor}: points"),
                Style::Joined,
                of(&|t| t.score.points_on_target as f64),
            )
            .series("", Style::Dashed, of(&|t| t.predicted.samples));
        chart.series.iter_mut().rev().take(2).for_each(|series| series.hue = hue);
    }
    chart.legend = true;
    Figure::svg(
        &chart.svg(),
        "Points decoded on the car (dots) and the samples that geometry predicts (dashed).",
    )
}

/// The claim of the title: refresh rate against range, waiting and not waiting for echoes.
pub(super) fn refresh_over_range(design: &Design) -> Figure {
    let directions = design.shots_per_scan() as f64;
    let waiting = |range: f64, beams: f64| beams / (tof_from_range(range) * directions);
    let ranges: Vec<f64> = (0..=60).map(|i| 10_f64.powf(f64::from(i) / 20.0)).collect();
    let curve = |beams: f64| ranges.iter().map(|&r| [r, waiting(r, beams)]).collect();
    let coded = design.derived();
    let reuse = coded.unambiguous_range.unwrap_or(f64::INFINITY);
    let rate = 1.0 / design.scan_period();
    let x = Axis::log("maximum range, m").limits(1.0, 1000.0);
    let mut chart =
        Chart::new("Refresh rate against range", x, Axis::log("scans per second").limits(0.1, 1e3))
            .series("waits, 1 beam", Style::Line, curve(1.0))
            .series("waits, 64 beams", Style::Line, curve(64.0))
            .series("coded, 1 beam", Style::Line, vec![[1.0, rate], [reuse, rate]]);
    chart.lines.push(Line::AtX(reuse, format!("words return: {reuse:.0} m")));
    chart.notes.push(Note {
        at: [design.scan.rated_range, waiting(design.scan.rated_range, 1.0)],
        text: format!("{:.2} Hz at 150 m", waiting(design.scan.rated_range, 1.0)),
    });
    Figure::svg(
        &chart.svg(),
        &format!(
            "**The claim of the title.** With {directions:.0} directions, a beam that waits for \
             each echo cannot refresh faster than c/(2\u{b7}R\u{b7}N). A coded one does not wait, \
             until its code words repeat within the range gate."
        ),
    )
}

/// The same, directions against range at a fixed refresh rate.
pub(super) fn directions_over_range(design: &Design) -> Figure {
    let rate = 1.0 / design.scan_period();
    let waiting = |range: f64, beams: f64| beams / (tof_from_range(range) * rate);
    let ranges: Vec<f64> = (0..=60).map(|i| 10_f64.powf(f64::from(i) / 20.0)).collect();
    let curve = |beams: f64| ranges.iter().map(|&r| [r, waiting(r, beams)]).collect();
    let reuse = design.derived().unambiguous_range.unwrap_or(f64::INFINITY);
    let directions = design.shots_per_scan() as f64;
    let x = Axis::log("maximum range, m").limits(1.0, 1000.0);
    let chart = Chart::new("Directions against range", x, Axis::log("directions at 60 Hz"))
        .series("waits, 1 beam", Style::Line, curve(1.0))
        .series("waits, 64 beams", Style::Line, curve(64.0))
        .series("coded, 1 beam", Style::Line, vec![[1.0, directions], [reuse, directions]]);
    Figure::svg(
        &chart.svg(),
        "Directions that can be measured 60 times a second. Sixty-four waiting beams catch up \
         with a single coded one; the code saves beams and detectors, not light.",
    )
}

/// The receivers as bars.
pub(super) fn receivers(comparisons: &[Comparison]) -> Figure {
    let own: Vec<&Comparison> =
        comparisons.iter().filter(|c| c.sensor == "kim-park-2016").collect();
    let mut detectors: Vec<&str> = own.iter().map(|c| c.detector).collect();
    detectors.dedup();
    let y = Axis::linear("right, % of the pixels with an echo").limits(0.0, 105.0);
    let mut chart = Chart::new("Receivers compared", Axis::categories("", &detectors), y);
    for receiver in RECEIVERS.map(ReceiverKind::name) {
        let points = detectors.iter().enumerate().filter_map(|(at, detector)| {
            let found = own.iter().find(|c| c.receiver == receiver && c.detector == *detector)?;
            Some([at as f64, (1000.0 * found.share(Outcome::Right)).round() / 10.0])
        });
        let points = points.collect();
        chart = chart.series(receiver, Style::Bars, points);
    }
    Figure::svg(&chart.svg(), "Pixels with the right range, by receiver, sensor `kim-park-2016`.")
}

/// All distances, in the order of the figures.
pub(super) fn figure_numbers() -> impl Iterator<Item = (u32, u32)> {
    (8..).zip(DISTANCES)
}
