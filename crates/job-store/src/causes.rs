//! Why an attempt at a task ended badly, where a worker or a coordinator says so and not the task itself. Reasons are kept as texts: these
//! are made here, and known again here, so that whoever shows one can say what to do.

/// A kind of reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Cause {
    /// The task used more memory than it may.
    Memory,
    /// The task took longer than it may.
    Time,
    /// The program of the task died.
    Died,
    /// The worker gave no sign of life any more.
    Silent,
}

const MEMORY: &str = " MB of memory, more than the limit of ";
const TIME: &str = "took longer than the limit of ";
const SILENT: &str = " fell silent";
/// How the system tells of the end of a program.
const ENDS: [&str; 2] = ["signal: ", "exit status: "];

impl Cause {
    /// The reason of a task that used more memory than it may, MB.
    #[must_use]
    pub fn memory(used: u64, most: u64) -> String {
        format!("used {used}{MEMORY}{most} MB")
    }

    /// The reason of a task that took longer than so many seconds.
    #[must_use]
    pub fn time(most: f64) -> String {
        format!("{TIME}{most} s")
    }

    /// The reason of a task whose program died: what the system says of its end, and what it said last, if anything.
    #[must_use]
    pub fn died(status: std::process::ExitStatus, said: &str) -> String {
        if said.is_empty() { status.to_string() } else { format!("{status}: {said}") }
    }

    /// The reason of a task whose worker gave no sign of life any more.
    #[must_use]
    pub fn silent(worker: &str) -> String {
        format!("worker {worker}{SILENT}")
    }

    /// The kind of a reason; none if the task itself said why.
    #[must_use]
    pub fn of(reason: &str) -> Option<Self> {
        if reason.starts_with("used ") && reason.contains(MEMORY) {
            Some(Self::Memory)
        } else if reason.starts_with(TIME) {
            Some(Self::Time)
        } else if ENDS.iter().any(|end| reason.starts_with(end)) {
            Some(Self::Died)
        } else if reason.starts_with("worker ") && reason.ends_with(SILENT) {
            Some(Self::Silent)
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_are_known_again() {
        assert_eq!(Cause::of(&Cause::memory(4100, 4096)), Some(Cause::Memory));
        assert_eq!(Cause::of(&Cause::time(0.5)), Some(Cause::Time));
        assert_eq!(Cause::of(&Cause::silent("host-1-0")), Some(Cause::Silent));
        assert_eq!(Cause::of("mesh.obj: line 2: face with 2 corners"), None);
        assert_eq!(Cause::of("sample of 3_7: used memory"), None);
    }

    #[cfg(unix)]
    #[test]
    fn a_death_is_known_by_what_the_system_says() {
        use std::os::unix::process::ExitStatusExt as _;
        for (status, said) in [(9, ""), (6, "index out of bounds"), (101 << 8, "no more memory")] {
            let reason = Cause::died(std::process::ExitStatus::from_raw(status), said);
            assert_eq!(Cause::of(&reason), Some(Cause::Died), "{reason}");
            assert!(reason.ends_with(said));
        }
    }
}
