//! An S3 server of the tests' own (moto), on a private port, gone when they end.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// A new, empty bucket.
#[derive(Clone, Debug)]
pub(crate) struct Bucket {
    /// Its place, such as `s3://bucket`.
    pub(crate) place: String,
    /// Port of its server on this machine.
    pub(crate) port: u16,
}

impl Bucket {
    /// The variables of the environment that lead to it, through a port of this machine.
    pub(crate) fn variables(port: u16) -> [(String, String); 4] {
        [
            ("AWS_ENDPOINT_URL".to_owned(), format!("http://127.0.0.1:{port}")),
            ("AWS_REGION".to_owned(), "us-east-1".to_owned()),
            ("AWS_ACCESS_KEY_ID".to_owned(), "tests".to_owned()),
            ("AWS_SECRET_ACCESS_KEY".to_owned(), "no secret".to_owned()),
        ]
    }
}

/// A bucket of this name; none, with a printed reason, where moto is not installed.
pub(crate) fn bucket(name: &str) -> Option<Bucket> {
    static SERVER: OnceLock<Result<u16, String>> = OnceLock::new();
    let port = match SERVER.get_or_init(start) {
        Ok(port) => *port,
        Err(reason) => {
            crate::skip(&format!("{name} on S3"), reason);
            return None;
        }
    };
    let name = name.replace('_', "-");
    let answer = put(port, &name, b"").expect("the S3 server answers");
    assert!(answer.starts_with("HTTP/1.1 200"), "making bucket {name}: {answer}");
    Some(Bucket { place: format!("s3://{name}"), port })
}

fn start() -> Result<u16, String> {
    let program = program().ok_or("the S3 server moto is not installed (tests/run gets it)")?;
    let port =
        std::net::TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).map_err(|e| e.to_string())?.port();
    // The server goes when this process is gone, however it ends.
    let script = r#"pid=$1; shift; "$@" & server=$!; while kill -0 "$pid" && kill -0 "$server"; do sleep 1; done; kill "$server""#;
    let shell = Command::new("sh")
        .args(["-c", script, "sh", &std::process::id().to_string()])
        .arg(program)
        .args(["-H", "127.0.0.1", "-p", &port.to_string()])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .current_dir("/")
        .spawn();
    drop(shell.map_err(|e| e.to_string())?);
    let begin = Instant::now();
    while TcpStream::connect(("127.0.0.1", port)).is_err() {
        if begin.elapsed() > Duration::from_secs(60) {
            return Err("the S3 server moto does not start".to_owned());
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    Ok(port)
}

/// Where `tests/run` has put it.
fn program() -> Option<PathBuf> {
    let tools = std::env::var_os("GABLE_TEST_TOOLS").map(PathBuf::from);
    let beside =
        || Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|a| a.join("target/test-tools")).find(|p| p.exists());
    let program = tools.or_else(beside)?.join("bin/moto_server");
    program.exists().then_some(program)
}

/// Puts an object, or makes a bucket; the server does not ask who we are.
pub(crate) fn put(port: u16, place: &str, content: &[u8]) -> std::io::Result<String> {
    let mut server = TcpStream::connect(("127.0.0.1", port))?;
    let length = content.len();
    write!(
        server,
        "PUT /{place} HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n"
    )?;
    server.write_all(content)?;
    let mut answer = String::new();
    server.read_to_string(&mut answer)?;
    Ok(answer)
}
