//! A small provider of OpenID Connect: it lets in whoever comes, and signs whatever it is told to.

use base64::Engine as _;
use base64::engine::general_purpose::{STANDARD, URL_SAFE_NO_PAD};
use ring::rand::SystemRandom;
use ring::signature::{RSA_PKCS1_SHA256, RsaKeyPair};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

/// A key of the tests alone.
const KEY: &[u8] = include_bytes!("provider-key.der");

/// The client that it knows.
pub(crate) const CLIENT: &str = "gable";
pub(crate) const SECRET: &str = "a secret: with / and %";

/// What is wrong with what it signs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wrong {
    Issuer,
    Audience,
    OtherParty,
    Ended,
    NotYet,
    NoEnd,
    Nonce,
    Signature,
    Unsigned,
    /// Signed by HMAC, with what everybody knows of the key.
    PublicSecret,
    UnknownKey,
}

impl Wrong {
    pub(crate) const ALL: [Self; 11] = [
        Self::Issuer,
        Self::Audience,
        Self::OtherParty,
        Self::Ended,
        Self::NotYet,
        Self::NoEnd,
        Self::Nonce,
        Self::Signature,
        Self::Unsigned,
        Self::PublicSecret,
        Self::UnknownKey,
    ];
}

/// What it does next.
#[derive(Debug, Default)]
struct State {
    /// Who comes.
    claims: Value,
    /// What it tells of them only when it is asked.
    more: Value,
    wrong: Option<Wrong>,
    denies: bool,
    codes: BTreeMap<String, BTreeMap<String, String>>,
    made: u32,
}

/// The provider.
#[derive(Clone, Debug)]
pub(crate) struct Provider {
    pub(crate) address: String,
    state: Arc<Mutex<State>>,
}

impl Provider {
    /// Starts one, which goes with the process.
    pub(crate) fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = format!("http://{}", listener.local_addr().expect("its address"));
        let provider = Self { address, state: Arc::default() };
        let serving = provider.clone();
        std::thread::spawn(move || {
            for client in listener.incoming().map_while(Result::ok) {
                // A client that goes away early is no matter.
                let _ = serving.answer(client);
            }
        });
        provider
    }

    fn state(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Says who comes next, by the claims that are signed, and those that are told when it is asked.
    pub(crate) fn sees(&self, claims: Value, more: Value) {
        let mut state = self.state();
        let made = state.made;
        *state = State { claims, more, made, ..State::default() };
    }

    /// Makes a fault in what is signed next.
    pub(crate) fn does_wrong(&self, wrong: Option<Wrong>) {
        self.state().wrong = wrong;
    }

    /// Lets nobody in.
    pub(crate) fn denies(&self) {
        self.state().denies = true;
    }

    fn answer(&self, client: TcpStream) -> std::io::Result<()> {
        let mut reader = BufReader::new(client.try_clone()?);
        let mut line = String::new();
        reader.read_line(&mut line)?;
        let (mut length, mut shown) = (0, String::new());
        loop {
            let mut header = String::new();
            reader.read_line(&mut header)?;
            let Some((name, value)) = header.trim().split_once(':') else { break };
            match name.to_ascii_lowercase().as_str() {
                "content-length" => length = value.trim().parse().unwrap_or(0),
                "authorization" => value.trim().clone_into(&mut shown),
                _ => {}
            }
        }
        let mut body = vec![0; length];
        reader.read_exact(&mut body)?;
        let target = line.split(' ').nth(1).unwrap_or_default().to_owned();
        let (path, query) = target.split_once('?').unwrap_or((&target, ""));
        let (status, place, content) = match path {
            "/.well-known/openid-configuration" => (200, None, self.description()),
            "/keys" => (200, None, keys()),
            "/authorize" => (303, Some(self.authorise(form(query))), json!({})),
            "/token" => match self.token(&form(&String::from_utf8_lossy(&body)), &shown) {
                Ok(tokens) => (200, None, tokens),
                Err(error) => (400, None, json!({ "error": error })),
            },
            "/userinfo" if shown == "Bearer access" => (200, None, self.state().more.clone()),
            _ => (404, None, json!({})),
        };
        let content = content.to_string();
        let location = place.map(|place| format!("Location: {place}\r\n")).unwrap_or_default();
        let mut client = client;
        write!(
            client,
            "HTTP/1.1 {status} X\r\nContent-Type: application/json\r\n{location}Content-Length: {}\r\nConnection: close\r\n\r\n{content}",
            content.len()
        )
    }

    fn description(&self) -> Value {
        let at = |path: &str| format!("{}{path}", self.address);
        json!({ "issuer": self.address, "authorization_endpoint": at("/authorize?from=tests"), "token_endpoint": at("/token"),
            "jwks_uri": at("/keys"), "userinfo_endpoint": at("/userinfo") })
    }

    /// Where a browser is sent that somebody signs in with.
    fn authorise(&self, asked: BTreeMap<String, String>) -> String {
        let mut state = self.state();
        let (redirect, token) = (asked["redirect_uri"].clone(), asked["state"].clone());
        let right = asked["response_type"] == "code"
            && asked["client_id"] == CLIENT
            && asked["code_challenge_method"] == "S256"
            && asked["scope"].split(' ').any(|scope| scope == "openid");
        if state.denies || !right {
            return format!("{redirect}?error=access_denied&state={token}");
        }
        state.made += 1;
        let code = format!("code-{}", state.made);
        state.codes.insert(code.clone(), asked);
        format!("{redirect}?code={code}&state={token}&session_state=x")
    }

    /// The tokens for a code, once.
    fn token(&self, asked: &BTreeMap<String, String>, shown: &str) -> Result<Value, &'static str> {
        let known = format!("Basic {}", STANDARD.encode(format!("{CLIENT}:a%20secret%3A%20with%20%2F%20and%20%25")));
        if shown != known {
            return Err("invalid_client");
        }
        let granted = self.state().codes.remove(&asked["code"]).ok_or("invalid_grant")?;
        let challenge = URL_SAFE_NO_PAD
            .encode(ring::digest::digest(&ring::digest::SHA256, asked["code_verifier"].as_bytes()).as_ref());
        if granted["code_challenge"] != challenge || granted["redirect_uri"] != asked["redirect_uri"] {
            return Err("invalid_grant");
        }
        Ok(json!({ "access_token": "access", "token_type": "Bearer", "id_token": self.signed(&granted["nonce"]) }))
    }

    fn signed(&self, nonce: &str) -> String {
        let state = self.state();
        let now = SystemTime::now().duration_since(UNIX_EPOCH).expect("after 1970").as_secs() as i64;
        let mut claims =
            json!({ "iss": self.address, "aud": CLIENT, "sub": "7", "iat": now, "exp": now + 300, "nonce": nonce });
        for (name, value) in state.claims.as_object().into_iter().flatten() {
            claims[name] = value.clone();
        }
        let mut header = json!({ "alg": "RS256", "kid": "first" });
        match state.wrong {
            Some(Wrong::Issuer) => claims["iss"] = json!("https://evil.example"),
            Some(Wrong::Audience) => claims["aud"] = json!("another"),
            Some(Wrong::OtherParty) => claims["aud"] = json!([CLIENT, "another"]),
            Some(Wrong::Ended) => claims["exp"] = json!(now - 300),
            Some(Wrong::NotYet) => claims["nbf"] = json!(now + 300),
            Some(Wrong::NoEnd) => claims["exp"] = json!("never"),
            Some(Wrong::Nonce) => claims["nonce"] = json!("another"),
            Some(Wrong::Unsigned) => header["alg"] = json!("none"),
            Some(Wrong::PublicSecret) => header["alg"] = json!("HS256"),
            Some(Wrong::UnknownKey) => header["kid"] = json!("second"),
            Some(Wrong::Signature) | None => {}
        }
        let encoded = |value: &Value| URL_SAFE_NO_PAD.encode(value.to_string());
        let text = format!("{}.{}", encoded(&header), encoded(&claims));
        let mut signature = match state.wrong {
            Some(Wrong::Unsigned) => Vec::new(),
            Some(Wrong::PublicSecret) => {
                let key = ring::hmac::Key::new(ring::hmac::HMAC_SHA256, &modulus());
                ring::hmac::sign(&key, text.as_bytes()).as_ref().to_vec()
            }
            _ => {
                let pair = RsaKeyPair::from_der(KEY).expect("a key");
                let mut signature = vec![0; pair.public().modulus_len()];
                pair.sign(&RSA_PKCS1_SHA256, &SystemRandom::new(), text.as_bytes(), &mut signature).expect("signed");
                signature
            }
        };
        if state.wrong == Some(Wrong::Signature) {
            signature[9] ^= 1;
        }
        format!("{text}.{}", URL_SAFE_NO_PAD.encode(signature))
    }
}

fn modulus() -> Vec<u8> {
    let pair = RsaKeyPair::from_der(KEY).expect("a key");
    ring::rsa::PublicKeyComponents::<Vec<u8>>::from(pair.public()).n
}

/// What it publishes of its keys; one is not for signatures, and one of a kind that nobody knows.
fn keys() -> Value {
    let pair = RsaKeyPair::from_der(KEY).expect("a key");
    let parts = ring::rsa::PublicKeyComponents::<Vec<u8>>::from(pair.public());
    let [n, e] = [parts.n, parts.e].map(|part| URL_SAFE_NO_PAD.encode(part));
    json!({ "keys": [
        { "kty": "RSA", "use": "enc", "alg": "RSA-OAEP", "kid": "zero", "n": n, "e": e },
        { "kty": "RSA", "use": "sig", "alg": "RS256", "kid": "first", "n": n, "e": e },
    ] })
}

/// The fields of a form.
fn form(text: &str) -> BTreeMap<String, String> {
    let pairs = text.split('&').filter_map(|pair| pair.split_once('='));
    pairs.map(|(name, value)| (name.to_owned(), unescaped(value))).collect()
}

fn unescaped(text: &str) -> String {
    let mut bytes = Vec::new();
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        match byte {
            b'%' => {
                let digits = [rest.next(), rest.next()].map(|digit| digit.unwrap_or(b'0') as char);
                bytes.push(u8::from_str_radix(&digits.iter().collect::<String>(), 16).expect("two digits"));
            }
            b'+' => bytes.push(b' '),
            byte => bytes.push(byte),
        }
    }
    String::from_utf8(bytes).expect("text")
}
