//! The report: one page with every table and figure of \[KP16\], made again from data.

use super::claim::Verdict;
use super::{Error, Findings, conclusion, experiment, pictures, side_by_side_page, tables};
use crate::record;
use crate::view::{Block, Page, Section, Tone};
use macropulse::points::Outcome;

/// Row and column of the pixel shown as an example: on the car at 30 m, sent with C7.
const EXAMPLE: (u16, u16) = (300, 430);

pub(super) fn page(findings: &Findings, seed: u64) -> Result<Page, Error> {
    let page = Page::new(
        "A lidar that does not wait, checked",
        "Kim and Park (2016) propose a scanning lidar whose every shot carries its own pixel \
         address as an optical CDMA code, so that it never waits for an echo. Here the whole \
         experiment runs again, chip by chip: three sensors, one car, four distances.",
    )
    .kicker("Macropulse")
    .section(summary(findings))
    .section(codes(findings)?)
    .section(transmission(findings))
    .section(parameters(findings))
    .section(images(findings)?)
    .section(counts(findings))
    .section(title(findings))
    .section(receivers(findings))
    .section(side_by_side_page::section(findings)?)
    .section(claims(findings))
    .section(conclusion(findings))
    .section(verdict(findings))
    .section(idealisations(findings))
    .files(&files(findings))
    .footer(&format!(
        "macropulse {}, seed {seed}. Every picture and number on this page was computed by the \
         run that wrote it; clouds, range images and manifests lie in the folders beside it.",
        env!("CARGO_PKG_VERSION")
    ));
    Ok(page)
}

/// Returns the files beside the page: the tables, and for each trial a page to explore its cloud.
fn files(findings: &Findings) -> Vec<String> {
    let tables = super::FILES[..super::FILES.len() - 1].iter().map(|file| (*file).to_owned());
    let pages = findings.trials.iter().map(|trial| {
        format!("{}/{}", experiment::folder(trial.sensor, trial.distance), record::PAGE)
    });
    tables.chain(pages).collect()
}

fn summary(findings: &Findings) -> Section {
    let count = |verdict| findings.claims.iter().filter(|c| c.verdict == verdict).count();
    let points = |sensor: &str, distance| {
        findings
            .trials
            .iter()
            .find(|t| t.sensor == sensor && t.distance == distance)
            .map_or(0, |t| t.score.points_on_target)
    };
    let numbers = [
        (points("kim-park-2016", 30).to_string(), "points on the car at 30 m".to_owned()),
        (points("kim-park-2016", 120).to_string(), "points at 120 m".to_owned()),
        (count(Verdict::Holds).to_string(), "claims hold".to_owned()),
        (count(Verdict::Partly).to_string(), "hold partly".to_owned()),
        (count(Verdict::Fails).to_string(), "fail".to_owned()),
    ];
    Section::new("In short")
        .block(Block::Numbers(numbers.to_vec()))
        .remark(
            Tone::Finding,
            "The idea holds, the design as printed does not",
            "Coded shots can be told apart and the point counts follow from geometry as claimed. \
             But the receiver described loses three pixels in five without any noise, because \
             most payloads begin with a dark bit; and at the energy that class 1 allows, a \
             micropulse returns a tenth of a photon from 150 m.",
        )
        .remark(
            Tone::Caution,
            "What was taken for granted",
            "The sensor is declared by what it can see, as in the paper. The list of effects that \
             are left out stands at the end of this page.",
        )
}

fn codes(findings: &Findings) -> Result<Section, Error> {
    let design = &findings.designs[0];
    let family = design.emission.coding().codebook.family();
    let mut section = Section::new("Codes: Tables 1 and 2, Fig. 4")
        .paragraph(
            "Prime sequences over GF(29), s(i, j) = i\u{b7}j mod 29. Code word C(i) has a mark at \
             chip s(i, j) + 29\u{b7}j for every j.",
        )
        .block(Block::Heading("Table 1. Prime sequences".into()))
        .table(tables::prime_sequences(family.weight() as u32))
        .figure(pictures::code_words(&family.words())?);
    if let Some(figure) = pictures::payload(design, EXAMPLE) {
        section = section.figure(figure);
    }
    Ok(section)
}

fn transmission(findings: &Findings) -> Section {
    let section = Section::new("Shots in flight: Fig. 2");
    match findings.trials.first() {
        Some(trial) => {
            section.figure(pictures::timeline(&findings.designs[0], trial, usize::from(EXAMPLE.0)))
        }
        None => section,
    }
}

fn parameters(findings: &Findings) -> Section {
    Section::new("Parameters: Table 3")
        .paragraph(
            "The paper's table is missing from our copy; these are the values of the sensor \
             files, printed by the program that used them.",
        )
        .table(tables::parameters(&findings.designs))
}

fn images(findings: &Findings) -> Result<Section, Error> {
    let mut section = Section::new("Range images: Figs. 8\u{2013}11").paragraph(
        "The same window of 4.8 m by 3.2 m around the car for all three sensors, the same colours \
         for the same range. Black is no return.",
    );
    for (number, distance) in pictures::figure_numbers() {
        section = section
            .block(Block::Heading(format!("Fig. {number}. The car at {distance} m")))
            .block(Block::Gallery(
                3,
                pictures::range_images(&findings.designs, &findings.trials, distance)?,
            ));
    }
    let mut clouds = Vec::new();
    for trial in findings.trials.iter().filter(|t| t.distance == 30) {
        clouds.push(pictures::cloud(trial)?);
    }
    Ok(section.block(Block::Heading("The clouds at 30 m".into())).block(Block::Gallery(3, clouds)))
}

fn counts(findings: &Findings) -> Section {
    let hidden: u64 = findings
        .trials
        .iter()
        .map(|t| t.score.samples_on_target.saturating_sub(t.score.points_on_target))
        .sum();
    Section::new("Points on the car: Table 4")
        .paragraph(
            "Samples are rays that meet the car; points are returns decoded on it. The prediction \
             is the solid angle of the car's silhouette over that of one sample, the band that of \
             one row and one column more or less.",
        )
        .table(tables::counts(&findings.trials))
        .figure(pictures::counts(&findings.trials))
        .table(tables::ratios(&findings.trials))
        .paragraph(&format!(
            "{hidden} samples in all gave no point on the car. Glass lets most of the light \
             through, black plastic and rubber send little back, and paint seen at a grazing \
             angle mirrors it away; the table says how many of each. The classical sensors, \
             declared by their data sheets, need more light than the coded one, which is declared \
             to see white at 150 m with 99 % of its micropulses: their shortfall is one of \
             sensitivity, not of sampling."
        ))
}

fn title(findings: &Findings) -> Section {
    let design = &findings.designs[0];
    Section::new("Refresh rate, range and directions")
        .figure(pictures::refresh_over_range(design))
        .figure(pictures::directions_over_range(design))
}

fn receivers(findings: &Findings) -> Section {
    let worst =
        findings.comparisons.iter().map(|c| c.score.count(Outcome::False)).max().unwrap_or(0);
    Section::new("Receivers")
        .paragraph(
            "**literal**: as printed, the first mark opens a macropulse. **blind**: tries how many \
             leading bits were dark. **matched**: correlates the whole known macropulse of every \
             shot in flight. Rows from the horizon to the road before the car at 50 m.",
        )
        .figure(pictures::receivers(&findings.comparisons))
        .table(tables::receivers(&findings.comparisons))
        .paragraph(&format!(
            "Missed pixels of the detector as declared are road seen at a grazing angle, where \
             fewer marks return than any threshold could tell from chance. At most {worst} pixels \
             without a surface gave an answer."
        ))
}

fn claims(findings: &Findings) -> Section {
    Section::new("Claims")
        .paragraph(
            "Every statement of the paper that can be checked. Unsaid: the paper leaves it open. \
             Assumed: it cannot be simulated from what is known, and is idealised.",
        )
        .table(tables::claims(&findings.claims))
}

fn conclusion(findings: &Findings) -> Section {
    Section::new("The conclusion, sentence by sentence")
        .paragraph(
            "Whether each sentence of the paper's conclusion holds, what has to be idealised for \
             it, and what replaces it among the ready sensors.",
        )
        .table(conclusion::table(findings))
}

/// Returns the verdict on the title: whether pulse coding gives an improved refresh rate, and at what price.
fn verdict(findings: &Findings) -> Section {
    let outlook = &findings.measured.on_paper.outlook;
    let range = findings.measured.on_paper.timing.rated_range;
    let (columns, rows, rate) = outlook.directions;
    let closing = outlook.closing.iter().filter(|sensor| sensor.lacks.is_empty());
    let names: Vec<String> = closing.map(|sensor| format!("`{}`", sensor.sensor)).collect();
    let finding = match names.as_slice() {
        [] => "No ready sensor that never waits closes by day at class 1.".to_owned(),
        names => format!(
            "Pulse coding does give a faster refresh, though not with one beam and words of many marks: \
             a lidar that never waits, as {}, sees 10 % at {range:.0} m by day at class 1, and needs \
             fewer channels than one that waits.",
            names.join(" or ")
        ),
    };
    Section::new("The title, after all")
        .paragraph(&format!(
            "{columns} x {rows} directions at {rate:.0} Hz to {range:.0} m: what it takes to do it without \
             waiting, and what a lidar with the same mirror takes that fires one pulse a shot and waits \
             for its echo. A lidar that waits only for its range takes what stands behind it for \
             something nearer; `macropulse design` weighs both for parts and wishes of your own."
        ))
        .block(Block::Remark(Tone::Finding, "Improved refresh rate".to_owned(), finding))
        .table(tables::closing(&outlook.closing))
}

fn idealisations(findings: &Findings) -> Section {
    let mut section = Section::new("Idealisations").paragraph(
        "Effects that are switched off in the sensor files, and in the environment of the scenes, \
         by their names there. Values that no file states come from the defaults and are listed in \
         each manifest.",
    );
    for design in &findings.designs {
        let items = design
            .idealised
            .iter()
            .map(|e| format!("`{}`: {}", e.name(), e.assumption()))
            .collect();
        section = section.block(Block::Heading(design.name.clone())).block(Block::List(items));
    }
    let environment = &findings.environment;
    let items = environment.idealised.iter();
    let items = items.map(|e| format!("`{}`: {}", e.name(), e.assumption())).collect();
    let heading = format!("The environment {}", environment.name);
    section.block(Block::Heading(heading)).block(Block::List(items))
}
