//! Chance for codes, by address: SplitMix64 \[SLF14\], begun anew for each (seed, index). It is
//! written out here because a codec depends on next to nothing.

/// Numbers drawn at one address.
#[derive(Debug)]
pub(super) struct Chance {
    state: u64,
}

impl Chance {
    pub fn new(seed: u64, index: u64) -> Self {
        Self { state: mixed(seed ^ mixed(index.wrapping_add(STEP))) }
    }

    /// A number below `n`, every one equally likely to n·2⁻⁶⁴.
    pub fn below(&mut self, n: u32) -> u32 {
        self.state = self.state.wrapping_add(STEP);
        ((u128::from(mixed(self.state)) * u128::from(n)) >> 64) as u32
    }

    /// Shuffles `things`: every order is equally likely.
    pub fn shuffle<T>(&mut self, things: &mut [T]) {
        for last in (1..things.len()).rev() {
            things.swap(last, self.below(last as u32 + 1) as usize);
        }
    }
}

/// 2⁶⁴ over the golden ratio, made odd.
const STEP: u64 = 0x9E37_79B9_7F4A_7C15;

fn mixed(number: u64) -> u64 {
    let number = (number ^ number >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let number = (number ^ number >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    number ^ number >> 31
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first numbers of the published generator from state 0.
    #[test]
    fn it_is_the_published_generator() {
        let drawn = [1, 2, 3].map(|step: u64| mixed(STEP.wrapping_mul(step)));
        let known = [0xE220_A839_7B1D_CDAF, 0x6E78_9E6A_A1B9_65F4, 0x06C4_5D18_8009_454F];
        assert_eq!(drawn, known);
    }

    #[test]
    fn neighbouring_addresses_have_nothing_in_common() {
        let draw = |seed, index| {
            let mut chance = Chance::new(seed, index);
            [0; 8].map(|_: u8| chance.below(1 << 16))
        };
        assert_eq!(draw(1, 2), draw(1, 2));
        for (seed, index) in [(1, 3), (2, 2), (2, 1), (0, 0)] {
            let same = draw(1, 2).into_iter().filter(|n| draw(seed, index).contains(n)).count();
            assert_eq!(same, 0, "{seed} {index}");
        }
    }
}
