//! `manifest.json`: what is needed to repeat a run and to judge it.

use macropulse::decode::Reject;
use macropulse::formats::{Entries, Manifest, Named};
use macropulse::points::Outcome;

use super::run::Run;

/// The manifest of a run.
pub fn of(run: &Run) -> Manifest {
    let (design, scene, tally) = (run.design, run.scene, &run.tally);
    let mut manifest = Manifest {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        seed: run.seed,
        sensor: Named { name: design.name.clone(), digest: digest(&design.text) },
        scene: Named { name: scene.name.clone(), digest: scene.digest() },
        defaults: Entries(design.defaults.clone()),
        idealisations: design.idealised.iter().map(|effect| effect.name().to_owned()).collect(),
        notes: scene.notes.iter().chain(&run.warnings).cloned().collect(),
        files: run.files.clone(),
        ..Manifest::default()
    };
    for (name, count) in [
        ("scans", run.scans),
        ("shots", tally.shots),
        ("surfaces", tally.surfaces),
        ("echoes", tally.echoes),
        ("edges", tally.edges),
        ("ticks", tally.ticks),
        ("returns", tally.returns),
    ] {
        manifest.counts.push(name, count);
    }
    for (kind, count) in Reject::ALL.into_iter().zip(tally.rejects) {
        manifest.rejects.push(kind.name(), count);
    }
    manifest.tdc.push("peak_busy", u64::from(tally.peak_busy));
    manifest.tdc.push("lost", tally.lost);
    manifest.tdc.push("merged", tally.merged);
    for outcome in Outcome::ALL {
        manifest.outcomes.push(outcome.name(), run.score.count(outcome));
    }
    for (stage, seconds) in run.stages() {
        manifest.stage_times_s.push(stage, seconds);
    }
    manifest.stage_times_s.push("elapsed", run.elapsed);
    manifest
}

/// The 64-bit FNV-1a hash of a text \[FNV\], as the scene's digest.
fn digest(text: &str) -> String {
    let hash = text.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    format!("{hash:016x}")
}

#[cfg(test)]
mod tests {
    use super::digest;

    #[test]
    fn the_digest_has_the_published_values() {
        assert_eq!(digest(""), "cbf29ce484222325");
        assert_eq!(digest("a"), "af63dc4c8601ec8c");
        assert_eq!(digest("foobar"), "85944171f73967e8");
    }
}
