//! The sandbox of a task's process: what it may read and write, whatever a mesh makes it do.
//!
//! Landlock (Linux 5.13 and later) restricts a process by its own wish, without privileges and for good. From 6.7 on it has no network
//! either, and from 6.12 on it sends no signals. Elsewhere a task runs as its user, which a worker says when it starts.

use std::path::{Path, PathBuf};

#[cfg(target_os = "linux")]
pub(crate) use linux::{enter, is_supported};

/// Says that there is none.
#[cfg(not(target_os = "linux"))]
pub(crate) fn is_supported() -> Result<(), String> {
    Err("this system has no Landlock".to_owned())
}

/// Does nothing, which was said by [`is_supported`].
#[cfg(not(target_os = "linux"))]
pub(crate) fn enter(_: &Path, _: &[PathBuf]) -> anyhow::Result<()> {
    Ok(())
}

#[cfg(target_os = "linux")]
mod linux {
    use super::{Path, PathBuf};
    use anyhow::Context as _;
    use landlock::{
        ABI, Access as _, AccessFs, AccessNet, CompatLevel, Compatible as _, PathBeneath, PathFd, Ruleset,
        RulesetAttr as _, RulesetCreatedAttr as _, Scope,
    };
    /// The rights that are known of; what an older system does not know is left out.
    const KNOWN: ABI = ABI::V6;

    /// What the program itself reads: of its own process, and what all programs may.
    const READ: [&str; 4] = ["/proc/self", "/dev/urandom", "/etc/ld.so.cache", "/sys/fs/cgroup"];

    /// Whether the system restricts what a process may read and write; why not.
    pub(crate) fn is_supported() -> Result<(), String> {
        let files = AccessFs::from_all(ABI::V1);
        let made = Ruleset::default().set_compatibility(CompatLevel::HardRequirement).handle_access(files);
        made.and_then(Ruleset::create).map(drop).map_err(|e| format!("the system has no Landlock ({e})"))
    }

    /// Restricts this process for good: it reads and writes in its `own` folder, reads in `read`, and does nothing else to
    /// files, the network or other processes. Threads that are under way already are not restricted.
    ///
    /// # Errors
    /// If the system refuses. One without Landlock does not.
    pub(crate) fn enter(own: &Path, read: &[PathBuf]) -> anyhow::Result<()> {
        let all = AccessFs::from_all(KNOWN);
        let rules = Ruleset::default()
            .set_compatibility(CompatLevel::BestEffort)
            .handle_access(all)
            .and_then(|rules| rules.handle_access(AccessNet::from_all(KNOWN)))
            .and_then(|rules| rules.scope(Scope::from_all(KNOWN)))
            .and_then(Ruleset::create)
            .context("the sandbox")?;
        let mut rules = rules.no_new_privs(true);
        let reading = AccessFs::ReadFile | AccessFs::ReadDir;
        let program = std::env::current_exe().into_iter();
        let given = read.iter().cloned().chain(program).map(|path| (path, reading));
        let system = READ.iter().map(|path| (PathBuf::from(path), reading));
        let null = (PathBuf::from("/dev/null"), AccessFs::ReadFile | AccessFs::WriteFile);
        let own = (own.to_owned(), all & !AccessFs::Execute);
        for (path, access) in given.chain(system).chain([null, own]) {
            // What is not there cannot be read either.
            if !path.exists() {
                continue;
            }
            let place = PathFd::new(&path).with_context(|| format!("the sandbox: {}", path.display()))?;
            let access = if path.is_dir() { access } else { access & AccessFs::from_file(KNOWN) };
            rules = rules.add_rule(PathBeneath::new(place, access)).context("the sandbox")?;
        }
        let status = rules.restrict_self().context("the sandbox")?;
        tracing::debug!(state = ?status.ruleset, "sandbox");
        Ok(())
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;
    use std::net::{TcpListener, TcpStream};

    #[test]
    fn a_task_reads_and_writes_what_it_is_given_and_nothing_else() {
        if let Err(why) = is_supported() {
            tracing::warn!("skipped: {why}");
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().to_owned();
        let at = move |name: &str| root.join(name);
        for name in ["own", "source", "other"] {
            std::fs::create_dir(at(name)).unwrap();
            std::fs::write(at(name).join("file"), name).unwrap();
        }
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        // A thread can be restricted alone, and with it those that it begins.
        let restricted = move || {
            enter(&at("own"), &[at("source")]).unwrap();
            let denied = |done: std::io::Result<()>| done.unwrap_err().kind() == std::io::ErrorKind::PermissionDenied;
            let read = |name: &str| std::fs::read_to_string(at(name).join("file"));
            assert_eq!((read("own").unwrap(), read("source").unwrap()), ("own".to_owned(), "source".to_owned()));
            assert!(denied(read("other").map(drop)) && denied(std::fs::read("/etc/passwd").map(drop)));
            assert!(denied(std::fs::read_dir(at("other")).map(drop)));
            std::fs::create_dir_all(at("own/inner")).unwrap();
            std::fs::write(at("own/inner/new"), "").unwrap();
            std::fs::rename(at("own/inner/new"), at("own/new")).unwrap();
            assert!(denied(std::fs::write(at("source/file"), "")) && denied(std::fs::write(at("other/new"), "")));
            assert!(denied(std::fs::remove_file(at("source/file"))));
            assert!(denied(TcpStream::connect(address).map(drop)));
            assert!(std::fs::read("/proc/self/stat").is_ok());
            assert!(denied(std::process::Command::new("/bin/sh").arg("-c").arg(":").status().map(drop)));
            let inner = std::thread::spawn(move || std::fs::read("/etc/passwd").map(drop));
            assert!(denied(inner.join().unwrap()));
        };
        std::thread::spawn(restricted).join().unwrap();
        assert!(std::fs::read("/etc/passwd").is_ok(), "the rest of the process is as it was");
    }
}
