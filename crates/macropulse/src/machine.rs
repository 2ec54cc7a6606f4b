//! The memory that this machine lets the program have.

use std::fs;
use std::path::{Path, PathBuf};

/// Returns the memory that the program may take in all, bytes, if the system tells it. It is the built-in
/// memory, or less if the program or a group of programs that it belongs to has a limit of its own.
pub fn memory() -> Option<u64> {
    let built_in = kilobytes(&fs::read_to_string("/proc/meminfo").ok()?, "MemTotal:")?;
    let groups = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let limits = limits_of_groups(&groups, Path::new("/sys/fs/cgroup"));
    let limits =
        limits.iter().filter_map(|path| fs::read_to_string(path).ok()?.trim().parse().ok());
    Some(limits.chain(address_space()).fold(built_in, u64::min))
}

/// The bytes of the line that begins with `key`, in kB there.
fn kilobytes(text: &str, key: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

/// Returns the address space that the program may have (`ulimit -v`), less the part in use that is in no
/// memory: stacks of threads, mapped files.
fn address_space() -> Option<u64> {
    let limit = most_address_space(&fs::read_to_string("/proc/self/limits").ok()?)?;
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let idle = kilobytes(&status, "VmSize:")?.saturating_sub(kilobytes(&status, "VmRSS:")?);
    Some(limit.saturating_sub(idle))
}

/// The limit that `/proc/self/limits` tells; none if that is `unlimited`.
fn most_address_space(limits: &str) -> Option<u64> {
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// The files with the limits of our group and of those around it, by what `/proc/self/cgroup` says;
/// `root` is where they are found. A group without one says "max", or a number beyond any memory.
fn limits_of_groups(groups: &str, root: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for line in groups.lines() {
        let mut parts = line.splitn(3, ':').skip(1);
        let (Some(kinds), Some(group)) = (parts.next(), parts.next()) else { continue };
        let (base, file) = match kinds {
            "" => (root.to_owned(), "memory.max"),
            _ if kinds.split(',').any(|kind| kind == "memory") => {
                (root.join("memory"), "memory.limit_in_bytes")
            }
            _ => continue,
        };
        // Inside a container its own group may be all that is seen, at the root.
        let group = Path::new(group.trim_start_matches('/'));
        files.extend(group.ancestors().map(|group| base.join(group).join(file)));
    }
    files
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_of_programs_may_have_less_than_the_machine() {
        let told = "MemFree: 3 kB\nMemTotal:       16 kB\n";
        assert_eq!(kilobytes(told, "MemTotal:"), Some(16_384));
        let found = |groups: &str| limits_of_groups(groups, Path::new("/c"));
        let paths = |names: &[&str]| names.iter().map(PathBuf::from).collect::<Vec<_>>();
        assert_eq!(
            found("0::/a/b\n"),
            paths(&["/c/a/b/memory.max", "/c/a/memory.max", "/c/memory.max"])
        );
        let old = found("3:cpu,memory:/d\n1:name=systemd:/x\n");
        let file = "memory.limit_in_bytes";
        assert_eq!(
            old,
            [format!("/c/memory/d/{file}"), format!("/c/memory/{file}")].map(PathBuf::from)
        );
    }

    #[test]
    fn the_address_space_may_have_a_limit() {
        let line =
            |limit: &str| format!("Max cpu time  9 9 s\nMax address space  {limit} 9 bytes\n");
        assert_eq!(most_address_space(&line("2048000000")), Some(2_048_000_000));
        assert_eq!(most_address_space(&line("unlimited")), None);
    }
}
