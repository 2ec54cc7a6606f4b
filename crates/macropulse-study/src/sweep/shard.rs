//! A part of the jobs.

use std::str::FromStr;

use super::Error;

/// Every n-th job, from the i-th.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    index: usize,
    of: usize,
}

impl Shard {
    /// All jobs.
    pub const WHOLE: Self = Self { index: 0, of: 1 };

    /// True if the job of number `job`, from 0, belongs to this shard.
    pub fn has(self, job: usize) -> bool {
        job % self.of == self.index
    }

    /// Returns the shards that have any of `jobs`, as typed. They belong to the same division as this shard.
    pub fn with_any(self, jobs: &[usize]) -> Vec<String> {
        let shards = (0..self.of).map(|index| Self { index, ..self });
        let concerned = shards.filter(|shard| jobs.iter().any(|job| shard.has(*job)));
        concerned.map(|shard| format!("{}/{}", shard.index + 1, shard.of)).collect()
    }
}

impl FromStr for Shard {
    type Err = Error;

    /// `i/n`, i from 1 to n.
    fn from_str(typed: &str) -> Result<Self, Error> {
        const MOST: usize = 100_000;
        let parts = typed.split_once('/').and_then(|(index, of)| {
            Some((index.trim().parse::<usize>().ok()?, of.trim().parse::<usize>().ok()?))
        });
        match parts {
            Some((index, of)) if of <= MOST && (1..=of).contains(&index) => {
                Ok(Self { index: index - 1, of })
            }
            Some((_, of)) if (1..=MOST).contains(&of) => {
                Error::asked(format!("there is no shard {typed}: they are 1/{of} to {of}/{of}"))
            }
            _ => Error::asked(format!(
                "{typed} is no shard: write 2/4 for the second of four, and {MOST} at most"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_job_belongs_to_one_shard() {
        let shards = ["1/3", "2/3", "3/3"].map(|typed| Shard::from_str(typed).unwrap());
        for job in 0..20 {
            assert_eq!(shards.iter().filter(|shard| shard.has(job)).count(), 1);
            assert!(Shard::WHOLE.has(job));
        }
        assert_eq!(shards[0].with_any(&[0, 3, 5]), ["1/3", "3/3"]);
    }

    #[test]
    fn what_is_no_shard_is_refused() {
        for (typed, words) in [
            ("5/4", "no shard 5/4: they are 1/4 to 4/4"),
            ("0/4", "1/4 to 4/4"),
            ("1", "write 2/4"),
            ("a/b", "write 2/4"),
            ("1/0", "write 2/4"),
            ("-1/2", "write 2/4"),
            ("1/1000000000", "100000 at most"),
        ] {
            let told = Shard::from_str(typed).unwrap_err().to_string();
            assert!(told.contains(words), "{told}");
        }
    }
}
