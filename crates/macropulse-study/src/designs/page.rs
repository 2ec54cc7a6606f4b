//! The findings of a search, as a page with the picture of the frontier.

use super::frontier::{CHANNELS, Frontier};
use super::listing::{share, told};
use super::scenery::Scenery;
use super::trial::Counts;
use super::{Error, Found, Worst};
use crate::text::short;
use crate::view::{
    self, Align, Axis, Block, Cell, Chart, Figure, Hue, Line, Note, Page, Section, Series, Stack,
    Style, Table,
};

impl Found {
    /// The page, with links to the `files` beside it.
    pub fn page(&self, files: &[String]) -> Page {
        let lead = "What closed forms leave of all parts allowed, what simulation leaves of that, and \
                    up to where waiting is better.";
        let mut page = Page::new(&format!("Lidars for {}", self.required.name), lead)
            .kicker("Macropulse")
            .section(Section::new("Verdict").block(Block::Listing(self.verdict().text())));
        if let Some(frontier) = &self.frontier {
            page = page.section(
                Section::new("Where never waiting wins")
                    .paragraph(
                        "Solid, how far the light of a coded lidar goes at each rate; dashed, that of \
                         one that waits, with the same aperture. Grey, how far that one has time to \
                         wait with so many channels: left of and below its line it can. Across, the \
                         most that a coded lidar can with so many.",
                    )
                    .figure(Figure::svg(&frontier.chart().svg(), "")),
            );
        }
        page.section(Section::new("Side by side").block(Block::Listing(self.side_by_side())))
            .section(Section::new("Mirrors").block(Block::Listing(self.table_of_mirrors())))
            .section(Section::new("Assumptions").block(Block::Listing(self.assumptions())))
            .section(Section::new("Simulated").table(self.table_of_trials()))
            .section(
                Section::new("What the coded one hangs on")
                    .paragraph("One thing changed at a time, all else as it is.")
                    .table(self.table_of_ablations()),
            )
            .section(Section::new("All of it").block(Block::Listing(self.text())))
            .files(files)
    }

    /// The picture of the frontier; `None` where there is none.
    fn picture(&self) -> Option<Stack> {
        let charts = vec![self.frontier.as_ref()?.chart()];
        Some(Stack { title: self.required.name.clone(), charts })
    }

    /// The frontier as CSV; `None` where there is none.
    pub fn csv(&self) -> Option<String> {
        let frontier = self.frontier.as_ref()?;
        let ranges = |what: &str| {
            frontier
                .reflectances
                .map(|reflectance| format!("{what}_{}_percent_m", short(reflectance * 100.0)))
                .join(",")
        };
        let mut text = format!(
            "scans_per_s,pixels_per_s,{},{},coded_channels,{}\n",
            ranges("coded"),
            ranges("waiting"),
            CHANNELS.map(|channels| format!("time_{channels}_channels_m")).join(",")
        );
        for row in &frontier.rows {
            let numbers = [row.scans_per_s, row.pixels_per_s]
                .into_iter()
                .chain(row.coded)
                .chain(row.waiting)
                .chain([row.coded_channels])
                .chain(row.time);
            let cells: Vec<String> = numbers.map(|number| number.to_string()).collect();
            text += &(cells.join(",") + "\n");
        }
        Some(text)
    }

    fn table_of_trials(&self) -> Table {
        let mut table = Table::new("", &[("lidar", Align::Left), ("aperture, mm", Align::Right)]);
        table.header.extend(header());
        let last = [("worst: Pd", Align::Right), ("at, m", Align::Right), ("limit", Align::Left)];
        table.header.extend(last.map(|(name, align)| (name.to_owned(), align)));
        for trial in &self.trials {
            let mut cells: Vec<Cell> =
                vec![trial.candidate.name().into(), short(trial.candidate.aperture * 1e3).into()];
            cells.extend(found(&trial.counts));
            let Worst { pd, range } = trial.worst;
            cells.extend([format!("{pd:.4}").into(), format!("{range:.2}").into()]);
            let verdict = match trial.limit {
                None => view::Verdict::Holds,
                Some(_) => view::Verdict::Fails,
            };
            cells.push(Cell::verdict(verdict, &told(trial.limit)));
            table.rows.push(cells);
        }
        table
    }

    fn table_of_ablations(&self) -> Table {
        let mut table = Table::new("", &[("changed", Align::Left)]);
        table.header.extend(header());
        let unchanged = self.best[0].iter().map(|best| ("nothing", &best.trial.counts));
        let changed = self.ablations.iter().map(|one| (one.what.as_str(), &one.counts));
        for (what, counts) in unchanged.chain(changed) {
            let mut cells: Vec<Cell> = vec![what.into()];
            cells.extend(found(counts));
            table.rows.push(cells);
        }
        table
    }
}

fn header() -> Vec<(String, Align)> {
    let of = |scenery: Scenery| {
        ["Pd", "wrong", "false", "rms, cm"]
            .map(|what| (format!("{}: {what}", scenery.name()), Align::Right))
    };
    Scenery::ALL.into_iter().flat_map(of).collect()
}

fn found(counts: &[Counts; 2]) -> Vec<Cell> {
    let of = |counts: &Counts| {
        [
            format!("{:.4}", counts.pd()),
            share(counts.wrong_share()),
            share(counts.false_share()),
            format!("{:.2}", counts.rms() * 100.0),
        ]
    };
    counts.iter().flat_map(of).map(Cell::from).collect()
}

/// Nearest range that the picture shows, m.
const NEAREST: f64 = 10.0;

impl Frontier {
    /// Rate against range.
    fn chart(&self) -> Chart {
        let x = Axis::log("Range, m; grey: in reach of so many channels that wait");
        let y = Axis::log("Million pixels per second");
        let mut chart = Chart::new("Rate against range", x, y);
        chart.legend = true;
        let rate = |row: &super::Row| row.pixels_per_s * 1e-6;
        for (at, (reflectance, hue)) in self.reflectances.iter().zip(Hue::ALL).enumerate() {
            let percent = short(reflectance * 100.0);
            let mut series = |label: String, style, far: &dyn Fn(&super::Row) -> f64| {
                let points = self.rows.iter().map(|row| [far(row), rate(row)]).collect();
                chart.series.push(Series { label, points, style, hue });
            };
            series(format!("coded, {percent} %"), Style::Line, &|row| row.coded[at]);
            series(format!("waiting, {percent} %"), Style::Dashed, &|row| row.waiting[at]);
        }
        let farthest = self.rows.iter().flat_map(|row| row.waiting).fold(0.0, f64::max);
        let [slowest, fastest] =
            [self.rows.first(), self.rows.last()].map(|row| row.map_or(f64::NAN, rate));
        for (at, channels) in CHANNELS.iter().enumerate() {
            let there = |row: &&super::Row| row.time[at] >= NEAREST && row.time[at] <= farthest;
            let points: Vec<[f64; 2]> =
                self.rows.iter().filter(there).map(|row| [row.time[at], rate(row)]).collect();
            if let Some(&at) = points.first() {
                chart.notes.push(Note { at, text: channels.to_string() });
            }
            let (label, style, hue) = (String::new(), Style::Joined, Hue::Grey);
            chart.series.push(Series { label, points, style, hue });
            let most = f64::from(*channels) * self.coded_duty / self.coded_period * 1e-6;
            if most >= slowest && most <= fastest {
                chart.lines.push(Line::AtY(most, format!("{channels} channels coded")));
            }
        }
        chart
    }
}

impl Found {
    /// The picture as SVG and PNG; `None` where there is none.
    ///
    /// # Errors
    /// If it cannot be drawn.
    pub fn drawn(&self) -> Result<Option<(String, Vec<u8>)>, Error> {
        let Some(picture) = self.picture() else { return Ok(None) };
        Ok(Some((picture.svg(), picture.png()?)))
    }
}
