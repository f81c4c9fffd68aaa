//! Opens the file, the connection or the server that a recording goes to.

use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::path::PathBuf;
use std::time::Duration;

use re_sdk::external::re_uri::RedapUri;
use re_sdk::{MemoryLimit, RecordingStream, RecordingStreamBuilder, ServerOptions};

/// Time limit for a viewer's first answer.
pub(super) const CONNECT_PATIENCE: Duration = Duration::from_secs(3);

/// Memory of the server for viewers that connect later [bytes]; beyond that it forgets the oldest rows.
const SERVER_MEMORY: u64 = 1 << 30;

/// The destination of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RecordingTarget {
    /// Into this file.
    File(PathBuf),
    /// To the viewer that listens at this address, `rerun+http://127.0.0.1:9876/proxy` or `host:port`.
    Connect(String),
    /// To the viewers that connect to this address of this machine; the URL is a notice of the sink.
    Serve(IpAddr),
}

impl RecordingTarget {
    /// Its name in messages.
    pub(super) fn display_name(&self) -> PathBuf {
        match self {
            RecordingTarget::File(path) => path.clone(),
            RecordingTarget::Connect(url) => PathBuf::from(url),
            RecordingTarget::Serve(_) => PathBuf::from("Rerun server"),
        }
    }

    /// Whether a viewer can watch the run while it happens.
    pub(super) fn is_live(&self) -> bool {
        !matches!(self, RecordingTarget::File(_))
    }
}

/// Opens the stream; a server also has an address.
pub(super) fn open_stream(
    builder: RecordingStreamBuilder,
    target: &RecordingTarget,
) -> Result<(RecordingStream, Option<String>), String> {
    match target {
        RecordingTarget::File(path) => {
            let stream = builder.save(path).map_err(|it| it.to_string())?;
            Ok((stream, None))
        }
        RecordingTarget::Connect(url) => Ok((connect_to_viewer(builder, url)?, None)),
        RecordingTarget::Serve(address) => {
            serve_recording(builder, *address).map(|(stream, url)| (stream, Some(url)))
        }
    }
}

fn connect_to_viewer(builder: RecordingStreamBuilder, url: &str) -> Result<RecordingStream, String> {
    let url = match url.contains("://") {
        true => url.to_owned(),
        false => format!("rerun+http://{url}/proxy"),
    };
    let Ok(RedapUri::Proxy(proxy)) = url.parse() else {
        return Err("a viewer's address reads rerun+http://<host>:<port>/proxy".into());
    };
    // The SDK would wait for ever for somebody to listen.
    let (host, port) = (proxy.origin.host.to_string(), proxy.origin.port);
    let addresses = (host.trim_matches(['[', ']']), port).to_socket_addrs();
    let mut addresses = addresses.map_err(|it| format!("unknown host {host}: {it}"))?;
    if !addresses.any(|it| TcpStream::connect_timeout(&it, CONNECT_PATIENCE).is_ok()) {
        return Err(format!("no Rerun viewer listens at {host}:{port}"));
    }
    builder.connect_grpc_opts(url).map_err(|it| it.to_string())
}

fn serve_recording(
    builder: RecordingStreamBuilder,
    address: IpAddr,
) -> Result<(RecordingStream, String), String> {
    // The SDK's server does not report a port in use.
    let port = TcpListener::bind((address, re_sdk::DEFAULT_SERVER_PORT))
        .or_else(|_| TcpListener::bind((address, 0)))
        .and_then(|it| it.local_addr())
        .map_err(|it| format!("cannot serve at {address}: {it}"))?
        .port();
    let options =
        ServerOptions { memory_limit: MemoryLimit::from_bytes(SERVER_MEMORY), ..ServerOptions::default() };
    let host = match address {
        IpAddr::V4(address) => address.to_string(),
        IpAddr::V6(address) => format!("[{address}]"),
    };
    let stream = builder.serve_grpc_opts(host, port, options).map_err(|it| it.to_string())?;
    // "All addresses" is not one to connect to.
    let known = match address {
        IpAddr::V4(it) if it.is_unspecified() => std::net::Ipv4Addr::LOCALHOST.into(),
        IpAddr::V6(it) if it.is_unspecified() => std::net::Ipv6Addr::LOCALHOST.into(),
        address => address,
    };
    Ok((stream, format!("rerun+http://{}/proxy", SocketAddr::new(known, port))))
}
