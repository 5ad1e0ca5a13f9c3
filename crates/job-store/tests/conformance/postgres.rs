//! A Postgres server of the tests' own, on a private port and folder, gone when they end.

use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::OnceLock;

struct Server {
    port: u16,
}

/// The address of a new, empty database; none, with a printed reason, where Postgres is not installed.
pub(crate) fn database(name: &str) -> Option<String> {
    static SERVER: OnceLock<Result<Server, String>> = OnceLock::new();
    let server = match SERVER.get_or_init(start) {
        Ok(server) => server,
        Err(reason) => {
            crate::skip(&format!("{name} on Postgres"), reason);
            return None;
        }
    };
    let programs = programs().expect("they were there");
    let made = user(&programs.join("createdb").to_string_lossy())
        .args(["-h", "127.0.0.1", "-p", &server.port.to_string(), "-U", "gable", name])
        .output()
        .expect("createdb runs");
    assert!(made.status.success(), "createdb: {}", String::from_utf8_lossy(&made.stderr));
    Some(format!("postgres://gable@127.0.0.1:{}/{name}", server.port))
}

fn start() -> Result<Server, String> {
    let programs = programs().ok_or("Postgres is not installed (package postgresql)")?;
    let folder = folder();
    std::fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
    if is_root() {
        // Postgres does not run as root.
        run(Command::new("chown").arg("postgres").arg(&folder))?;
    }
    let data = folder.join("data");
    run(user(&programs.join("initdb").to_string_lossy())
        .args(["-A", "trust", "-U", "gable", "--no-sync", "-E", "UTF8", "-D"])
        .arg(&data))?;
    let port =
        std::net::TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).map_err(|e| e.to_string())?.port();
    let options = format!(
        "-p {port} -c listen_addresses=127.0.0.1 -c unix_socket_directories= -c fsync=off -c max_connections=200"
    );
    let log = folder.join("log");
    run(user(&programs.join("pg_ctl").to_string_lossy())
        .arg("-D")
        .arg(&data)
        .arg("-l")
        .arg(&log)
        .args(["-w", "-o", &options, "start"]))?;
    watch(&programs, &folder);
    Ok(Server { port })
}

/// The server's folder; its data is in `data`.
pub(crate) fn folder() -> PathBuf {
    std::env::temp_dir().join(format!("gable-postgres-{}", std::process::id()))
}

/// Stops the server and removes its folder when this process is gone, however it ends.
fn watch(programs: &std::path::Path, folder: &std::path::Path) {
    let script =
        r#"pid=$1; folder=$2; shift 2; while kill -0 "$pid" 2>/dev/null; do sleep 1; done; "$@"; rm -rf "$folder""#;
    let stop = user(&programs.join("pg_ctl").to_string_lossy());
    let mut command = Command::new("sh");
    command.args(["-c", script, "sh", &std::process::id().to_string()]).arg(folder);
    command.arg(stop.get_program()).args(stop.get_args()).arg("-D").arg(folder.join("data"));
    command.args(["-m", "immediate", "stop"]).current_dir("/");
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    // Left to itself: it outlives the tests on purpose.
    drop(command.spawn().expect("sh runs"));
}

pub(crate) fn programs() -> Option<PathBuf> {
    let mut versions: Vec<PathBuf> =
        std::fs::read_dir("/usr/lib/postgresql").ok()?.flatten().map(|e| e.path().join("bin")).collect();
    versions.sort();
    versions.into_iter().rev().find(|p| p.join("initdb").exists())
}

fn is_root() -> bool {
    Command::new("id").arg("-u").output().is_ok_and(|o| o.stdout.starts_with(b"0\n"))
}

/// A command as a user that Postgres accepts.
pub(crate) fn user(program: &str) -> Command {
    let mut command;
    if is_root() {
        command = Command::new("setpriv");
        command.args(["--reuid=postgres", "--regid=postgres", "--clear-groups", program]);
    } else {
        command = Command::new(program);
    }
    command.current_dir("/");
    command
}

fn run(command: &mut Command) -> Result<(), String> {
    // Not `output`: the server that pg_ctl leaves behind would keep the pipe open.
    let errors = tempfile::tempfile().map_err(|e| e.to_string())?;
    let status = command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(errors.try_clone().map_err(|e| e.to_string())?)
        .status()
        .map_err(|e| format!("{command:?}: {e}"))?;
    if status.success() {
        return Ok(());
    }
    use std::io::{Read, Seek};
    let mut errors = errors;
    let mut text = String::new();
    errors.rewind().and_then(|()| errors.read_to_string(&mut text)).map_err(|e| e.to_string())?;
    Err(format!("{command:?}: {status}: {text}"))
}
