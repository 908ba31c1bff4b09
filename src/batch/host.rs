//! What the machine gives this process: memory and processors, with the limits of containers (control groups).

use std::fs::read_to_string;
use std::path::{Path, PathBuf};

/// Where control groups are mounted.
const GROUPS: &str = "/sys/fs/cgroup";
/// The groups that this process is in.
const OWN_GROUPS: &str = "/proc/self/cgroup";

/// Bytes of memory that this process may use at most: the machine's, or less where a control group limits it; `None`
/// where the system does not tell.
pub fn memory_total() -> Option<u64> {
    [meminfo("MemTotal:"), memory_limit()].into_iter().flatten().min()
}

/// Bytes of memory that are free for this process now, as the system estimates it.
pub fn memory_available() -> Option<u64> {
    let groups = read_to_string(OWN_GROUPS).unwrap_or_default();
    let left = memory_left_in(Path::new(GROUPS), &groups);
    [meminfo("MemAvailable:"), left].into_iter().flatten().min()
}

/// Bytes that control groups allow this process, if they limit it.
pub fn memory_limit() -> Option<u64> {
    memory_limit_in(Path::new(GROUPS), &read_to_string(OWN_GROUPS).ok()?)
}

/// Processors' worth of time that control groups allow this process, if they limit it.
pub fn cpu_quota() -> Option<f64> {
    cpu_quota_in(Path::new(GROUPS), &read_to_string(OWN_GROUPS).ok()?)
}

/// Threads that this process may run at once, by affinity and quota: what `--threads` is by default.
pub fn threads() -> usize {
    crate::render::memory::cores()
}

/// Processors of the machine that are switched on, whoever may use them.
pub fn processors() -> Option<usize> {
    let info = read_to_string("/proc/cpuinfo").ok()?;
    Some(info.lines().filter(|line| line.starts_with("processor")).count()).filter(|&n| n > 0)
}

/// The processors that this process may run on, such as `0-3,8`.
pub fn affinity() -> Option<String> {
    let status = read_to_string("/proc/self/status").ok()?;
    let list = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:"))?;
    Some(list.trim().to_owned())
}

fn meminfo(field: &str) -> Option<u64> {
    let text = read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(field))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

/// The folders of the groups in which `controller` limits this process, the innermost first: `groups` is the text of
/// `/proc/self/cgroup`. A container that sees its own group only has it at the top, whatever its path says.
fn folders(root: &Path, groups: &str, controller: &str) -> Vec<(PathBuf, bool)> {
    let mut folders = Vec::new();
    for line in groups.lines() {
        let mut fields = line.splitn(3, ':');
        let (Some(_), Some(controllers), Some(path)) = (fields.next(), fields.next(), fields.next()) else { continue };
        // Version 2 has one tree and names no controllers.
        let is_v2 = controllers.is_empty();
        let top = match controllers.split(',').any(|c| c == controller) {
            _ if is_v2 => root.to_owned(),
            true => root.join(controllers),
            false => continue,
        };
        let top = if is_v2 || top.is_dir() { top } else { root.join(controller) };
        let own = top.join(path.trim_start_matches('/'));
        let up = own.ancestors().take_while(|folder| folder.starts_with(&top));
        folders.extend(up.map(|folder| (folder.to_owned(), is_v2)));
    }
    folders
}

/// The number in the file of a group that holds nothing else; `None` for `max` too.
fn number(path: &Path) -> Option<u64> {
    read_to_string(path).ok()?.trim().parse().ok()
}

/// Version 1 says "no limit" by a number near 2^63.
const NO_LIMIT: u64 = 1 << 60;

fn memory_limit_in(root: &Path, groups: &str) -> Option<u64> {
    let file = |is_v2| if is_v2 { "memory.max" } else { "memory.limit_in_bytes" };
    let limits = folders(root, groups, "memory").into_iter().filter_map(|(folder, v2)| number(&folder.join(file(v2))));
    limits.filter(|&limit| limit < NO_LIMIT).min()
}

fn memory_left_in(root: &Path, groups: &str) -> Option<u64> {
    let files =
        |v2| if v2 { ["memory.max", "memory.current"] } else { ["memory.limit_in_bytes", "memory.usage_in_bytes"] };
    let left = folders(root, groups, "memory").into_iter().filter_map(|(folder, v2)| {
        let [limit, used] = files(v2).map(|file| number(&folder.join(file)));
        // Pages of files count as used and can be taken back at any time.
        let stat = read_to_string(folder.join("memory.stat")).unwrap_or_default();
        let cached = stat.lines().find_map(|l| l.strip_prefix("inactive_file ")?.trim().parse::<u64>().ok());
        Some(limit.filter(|&l| l < NO_LIMIT)?.saturating_sub(used?.saturating_sub(cached.unwrap_or(0))))
    });
    left.min()
}

fn cpu_quota_in(root: &Path, groups: &str) -> Option<f64> {
    let quotas = folders(root, groups, "cpu").into_iter().filter_map(|(folder, is_v2)| {
        let (quota, period) = if is_v2 {
            let text = read_to_string(folder.join("cpu.max")).ok()?;
            let (quota, period) = text.trim().split_once(' ')?;
            (quota.parse::<u64>().ok()?, period.parse::<u64>().ok()?)
        } else {
            (number(&folder.join("cpu.cfs_quota_us"))?, number(&folder.join("cpu.cfs_period_us"))?)
        };
        (period > 0).then(|| quota as f64 / period as f64)
    });
    quotas.min_by(f64::total_cmp)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tree of groups: files with their contents.
    fn tree(files: &[(&str, &str)]) -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        for (path, text) in files {
            let path = root.path().join(path);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        }
        root
    }

    #[test]
    fn the_least_limit_of_all_groups_above_counts_in_version_2() {
        let root = tree(&[
            ("job/memory.max", "8589934592\n"),
            ("job/inner/memory.max", "max\n"),
            ("job/inner/memory.current", "5\n"),
            ("job/memory.current", "1589934592\n"),
            ("job/memory.stat", "anon 5\ninactive_file 589934592\n"),
            ("job/cpu.max", "150000 100000\n"),
            ("job/inner/cpu.max", "max 100000\n"),
        ]);
        let groups = "0::/job/inner\n";
        assert_eq!(memory_limit_in(root.path(), groups), Some(8 << 30));
        assert_eq!(memory_left_in(root.path(), groups), Some((8 << 30) - 1_000_000_000));
        assert_eq!(cpu_quota_in(root.path(), groups), Some(1.5));
    }

    #[test]
    fn version_1_has_a_tree_for_each_controller() {
        let root = tree(&[
            ("memory/memory.limit_in_bytes", "9223372036854771712\n"),
            ("memory/docker/x/memory.limit_in_bytes", "1073741824\n"),
            ("memory/docker/x/memory.usage_in_bytes", "73741824\n"),
            ("cpu,cpuacct/docker/x/cpu.cfs_quota_us", "-1\n"),
            ("cpu,cpuacct/docker/cpu.cfs_quota_us", "400000\n"),
            ("cpu,cpuacct/docker/cpu.cfs_period_us", "100000\n"),
        ]);
        let groups = "11:memory:/docker/x\n4:cpu,cpuacct:/docker/x\n1:name=systemd:/docker/x\n";
        assert_eq!(memory_limit_in(root.path(), groups), Some(1 << 30));
        assert_eq!(memory_left_in(root.path(), groups), Some(1_000_000_000));
        assert_eq!(cpu_quota_in(root.path(), groups), Some(4.0));
    }

    #[test]
    fn a_container_that_sees_only_its_own_group_has_it_at_the_top() {
        let root = tree(&[("memory.max", "123456789"), ("cpu.max", "max 100000")]);
        assert_eq!(memory_limit_in(root.path(), "0::/not/visible/here\n"), Some(123_456_789));
        assert_eq!(cpu_quota_in(root.path(), "0::/not/visible/here\n"), None);
        assert_eq!(memory_limit_in(root.path(), "nonsense"), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn this_machine_has_memory_and_a_processor() {
        let total = memory_total().unwrap();
        assert!((1 << 26..1 << 50).contains(&total), "{total}");
        assert!(memory_available().unwrap() <= total);
        assert!(
            threads() >= 1
                && processors().unwrap() >= 1
                && affinity().unwrap().starts_with(|c: char| c.is_ascii_digit())
        );
    }
}
