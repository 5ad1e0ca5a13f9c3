//! A way to a server that can be cut, as a network that fails would.

use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Hands connections on to a port of this machine, unless it is cut.
#[derive(Debug)]
pub struct Proxy {
    address: SocketAddr,
    way: Arc<Way>,
}

#[derive(Debug, Default)]
struct Way {
    cut: AtomicBool,
    open: Mutex<Vec<TcpStream>>,
}

impl Way {
    fn hand_on(self: &Arc<Self>, client: TcpStream, port: u16) -> std::io::Result<()> {
        let server = TcpStream::connect(("127.0.0.1", port))?;
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        // Under the lock, so that a cut misses no connection.
        if self.cut.load(Ordering::SeqCst) {
            return Ok(());
        }
        open.retain(|stream| stream.peer_addr().is_ok());
        for (from, to) in [(&client, &server), (&server, &client)] {
            open.push(from.try_clone()?);
            let (mut from, mut to) = (from.try_clone()?, to.try_clone()?);
            std::thread::spawn(move || {
                std::io::copy(&mut from, &mut to).ok();
                to.shutdown(Shutdown::Both).ok();
                from.shutdown(Shutdown::Both).ok();
            });
        }
        Ok(())
    }
}

impl Proxy {
    /// A way to this port.
    ///
    /// # Panics
    /// If no port can be had.
    #[must_use]
    pub fn to(port: u16) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("its address");
        let way = Arc::new(Way::default());
        let kept = Arc::clone(&way);
        std::thread::spawn(move || {
            for client in listener.incoming().map_while(Result::ok) {
                // A connection that cannot be handed on is closed, as a server that is away would.
                kept.hand_on(client, port).ok();
            }
        });
        Self { address, way }
    }

    /// Its port.
    #[must_use]
    pub fn port(&self) -> u16 {
        self.address.port()
    }

    /// Ends all connections, and takes no more; or takes them again.
    pub fn cut(&self, cut: bool) {
        let mut open = self.way.open.lock().unwrap_or_else(PoisonError::into_inner);
        self.way.cut.store(cut, Ordering::SeqCst);
        if cut {
            open.drain(..).for_each(|stream| drop(stream.shutdown(Shutdown::Both)));
        }
    }
}
