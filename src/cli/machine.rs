//! The machine and what it lets this process have: threads, memory, and the processor's time so far.

use groundglass::error::{Error, ErrorKind, Result};

/// User and system time of all threads of this process so far, in seconds; 0 where the system does not say.
pub(super) fn cpu_seconds() -> f64 {
    #[cfg(unix)]
    {
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
    }
    #[cfg(not(unix))]
    {
        0.0
    }
}

/// What the program itself takes beside scenes and pictures, where the system does not tell: code, stacks.
const ITSELF: u64 = 32 << 20;

/// What the C library sets aside for each thread, of the address space: a stack, and a heap of its own where one fits.
const STACK: u64 = 3 << 20;
const HEAP: u64 = 64 << 20;

/// How many threads to work on: as asked for, else as many as the machine has, and fewer where the address space is
/// limited, of which each takes its share.
pub(super) fn threads(asked: Option<u16>) -> usize {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let space = field(&text("/proc/self/limits"), "Max address space").unwrap_or(u64::MAX);
    let fit = usize::try_from(space / 4 / HEAP).unwrap_or(usize::MAX).max(1);
    asked.map_or(cores.min(fit), usize::from)
}

/// Does `work`, and what it shares out, on so many threads (as many as the machine has for `None`).
///
/// # Errors
/// [`ErrorKind::TooLarge`] when they cannot be started: threads that are started unasked would panic then.
pub(super) fn on_threads<T: Send>(threads: Option<usize>, work: impl FnOnce() -> T + Send) -> Result<T> {
    let pool =
        rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0)).build().map_err(|error| {
            Error::new(ErrorKind::TooLarge, format!("no threads can be started: {error}")).remedy(
                "ask for fewer threads, end other programs, or raise the limits on processes and memory",
            )
        })?;
    Ok(pool.install(work))
}

/// Bytes of memory that may yet be taken on so many threads: what the machine has free, and of `limit` what is not taken
/// yet.
pub(super) fn room(limit: Option<u64>, threads: usize) -> Option<u64> {
    let taken = || field(&text("/proc/self/status"), "VmRSS:").map_or(ITSELF, |kib| kib.saturating_mul(1024));
    let allowed = limit.map(|limit| limit.saturating_sub(taken()));
    [allowed, available_memory(threads as u64)].into_iter().flatten().min()
}

fn text(path: &str) -> String {
    std::fs::read_to_string(path).unwrap_or_default()
}

fn number(text: &str) -> Option<u64> {
    text.trim().parse().ok()
}

/// The number after a name in a file of the kernel's.
fn field(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    number(line.split_whitespace().next()?)
}

/// Bytes of memory that this process can still have without swapping, by the system's count, the control group's
/// limit and the limit of the address space; `None` where nothing of that is told.
fn available_memory(threads: u64) -> Option<u64> {
    let free = field(&text("/proc/meminfo"), "MemAvailable:").map(|kib| kib.saturating_mul(1024));
    let group = |limit: &str, used: &str| Some(number(&text(limit))?.saturating_sub(number(&text(used))?));
    // The process's own group and those above it; a version 1 hierarchy only as containers show it.
    let own = text("/proc/self/cgroup").lines().find_map(|line| line.strip_prefix("0::").map(str::to_owned));
    let groups =
        own.iter().flat_map(|own| std::path::Path::new(own).ancestors().collect::<Vec<_>>()).map(|path| {
            let folder = format!("/sys/fs/cgroup/{}", path.display());
            group(&format!("{folder}/memory.max"), &format!("{folder}/memory.current"))
        });
    let container = [
        group("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
        group("/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.usage_in_bytes"),
    ];
    let used = field(&text("/proc/self/status"), "VmSize:").map_or(0, |kib| kib.saturating_mul(1024));
    let space = field(&text("/proc/self/limits"), "Max address space").map(|most| {
        let left = most.saturating_sub(used);
        let heaps = (threads + 1).min(left / HEAP) * HEAP;
        // A fifth stays for what does not lie closely.
        left.saturating_sub(heaps + (threads + 1) * STACK) / 5 * 4
    });
    [free, space].into_iter().chain(groups).chain(container).flatten().min()
}
