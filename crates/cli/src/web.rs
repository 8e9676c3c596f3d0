//! The page that a browser opens: where it stands, and how it is served.

use lightgraph::{Checked, Diagnostic};
use std::fs::File;
use std::io::{self, Write};
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use tiny_http::{HTTPVersion, Header, Method, Request, Response, ResponseBox, Server};

/// A file that every page has.
const ENGINE: &str = "engine_bg.wasm";

/// The page that `make web` has made: the folder given, or one that lies where the program's own file does.
///
/// # Errors
/// There is none.
pub fn page(given: Option<&Path>) -> Checked<PathBuf> {
    let program = std::env::current_exe().ok();
    let home = program.as_deref().and_then(Path::parent).and_then(Path::parent);
    let usual = home.into_iter().flat_map(|home| ["web", "share/lightgraph/web"].map(|folder| home.join(folder)));
    let tried: Vec<PathBuf> = given.map_or_else(|| usual.collect(), |folder| vec![folder.to_path_buf()]);
    tried.iter().find(|folder| folder.join(ENGINE).is_file()).cloned().ok_or_else(|| {
        let list: Vec<String> = tried.iter().map(|p| p.display().to_string()).collect();
        let d = Diagnostic::error(format!("there is no page for a browser in {}", list.join(" or ")));
        d.help("make it with `make web`, which puts it into target/web, or name its folder").into()
    })
}

/// Answers requests for ever. Whoever reads slowly holds up nobody else.
pub fn serve(server: &Server, folder: &Path) {
    std::thread::scope(|scope| {
        for request in server.incoming_requests() {
            // Without a thread the connection is closed; whoever has gone away needs no answer.
            let _ = std::thread::Builder::new().spawn_scoped(scope, || answer(request, folder));
        }
    });
}

/// Answers by HTTP/1.0, so that a connection ends with its answer: where connections are kept, the server may leave a
/// new one waiting until another ends.
fn answer(request: Request, folder: &Path) -> io::Result<()> {
    let response = response(&request, folder);
    let bodiless = *request.method() == Method::Head;
    let headers = request.headers().to_vec();
    let mut writer = request.into_writer();
    response.raw_print(&mut writer, HTTPVersion(1, 0), &headers, bodiless, None)?;
    writer.flush()
}

fn response(request: &Request, folder: &Path) -> ResponseBox {
    let told = |code: u16, text: &str| Response::from_string(text).with_status_code(code).boxed();
    if !matches!(request.method(), Method::Get | Method::Head) {
        return told(405, "only GET is answered here\n");
    }
    let host = request.headers().iter().find(|h| h.field.equiv("Host")).map(|h| h.value.as_str());
    if !host.is_none_or(is_address) {
        return told(403, "this server answers to addresses and to localhost only\n");
    }
    let Some(path) = find(folder, request.url()) else { return told(404, "not found\n") };
    let Ok(file) = File::open(&path) else { return told(404, "not found\n") };
    let headers = [
        ("Content-Type", mime(&path)),
        // The page gets a process of its own, and nobody embeds it.
        ("Cross-Origin-Opener-Policy", "same-origin"),
        ("Cross-Origin-Embedder-Policy", "require-corp"),
        ("Cross-Origin-Resource-Policy", "same-origin"),
        ("X-Content-Type-Options", "nosniff"),
        ("Cache-Control", "no-cache"),
    ];
    let headers = headers.iter().filter_map(|(name, value)| Header::from_bytes(*name, *value).ok());
    headers.fold(Response::from_file(file), Response::with_header).boxed()
}

/// Whether a `Host` is an address or this machine: a name that somebody else gave to an address is none.
fn is_address(host: &str) -> bool {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|b| b.is_ascii_digit()) => name,
        _ => host,
    };
    name == "localhost" || name.trim_matches(['[', ']']).parse::<IpAddr>().is_ok()
}

/// The file that a URL names; nothing outside of the folder, nothing hidden.
fn find(folder: &Path, url: &str) -> Option<PathBuf> {
    let path = decoded(url.split(['?', '#']).next()?.strip_prefix('/')?)?;
    let hidden = |part: &str| part.starts_with('.') || part.contains(['\\', ':', '\0']);
    if path.split('/').any(hidden) {
        return None;
    }
    let mut file = folder.join(&path);
    if file.is_dir() {
        file.push("index.html");
    }
    // Links are followed within the folder only.
    let (file, folder) = (file.canonicalize().ok()?, folder.canonicalize().ok()?);
    (file.starts_with(&folder) && file.is_file()).then_some(file)
}

/// Without `%XX`.
fn decoded(path: &str) -> Option<String> {
    let mut out = vec![];
    let mut bytes = path.bytes();
    while let Some(byte) = bytes.next() {
        out.push(match byte {
            b'%' => {
                let mut digit = || char::from(bytes.next()?).to_digit(16);
                (digit()? * 16 + digit()?) as u8
            }
            _ => byte,
        });
    }
    // An absolute path would take the place of the folder.
    String::from_utf8(out).ok().filter(|path| !path.starts_with('/'))
}

fn mime(path: &Path) -> &'static str {
    match path.extension().and_then(|e| e.to_str()).unwrap_or_default() {
        "html" => "text/html; charset=utf-8",
        "js" | "mjs" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "wasm" => "application/wasm",
        "json" => "application/json",
        "png" => "image/png",
        "jpg" | "jpeg" => "image/jpeg",
        "webp" => "image/webp",
        "svg" => "image/svg+xml",
        "glb" => "model/gltf-binary",
        "gltf" => "model/gltf+json",
        "ron" | "wgsl" | "txt" | "cube" => "text/plain; charset=utf-8",
        _ => "application/octet-stream",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;
    use std::net::TcpStream;
    use std::time::Duration;
    use tempfile::TempDir;

    fn site() -> TempDir {
        let site = TempDir::new().unwrap();
        std::fs::create_dir_all(site.path().join("page/below")).unwrap();
        for (name, text) in [
            ("page/index.html", "<p>"),
            ("page/a b.wasm", "x"),
            ("page/.git", "x"),
            ("page/below/c.js", "x"),
            ("secret", "x"),
        ] {
            std::fs::write(site.path().join(name), text).unwrap();
        }
        site
    }

    #[test]
    fn no_url_leads_out_of_the_folder() {
        let site = site();
        let page = site.path().join("page");
        let name = |url: &str| find(&page, url).map(|p| p.file_name().unwrap().to_string_lossy().into_owned());
        assert_eq!(name("/").as_deref(), Some("index.html"));
        assert_eq!(name("/?x=../#y").as_deref(), Some("index.html"));
        assert_eq!(name("/a%20b.wasm").as_deref(), Some("a b.wasm"));
        assert_eq!(name("/below/c.js").as_deref(), Some("c.js"));
        let secret = site.path().join("secret").display().to_string();
        let out = [
            "/../secret",
            "/below/../../secret",
            "/%2e%2e/secret",
            "/..%2fsecret",
            "/below/%2e%2e/%2e%2e/secret",
            "/.git",
            "/below",
            "/nothing",
            "secret",
            "",
            "/%",
            "/%zz",
            "/%ff",
            "/a%00",
            "/..\\secret",
            &format!("/{secret}"),
            &format!("/{}", secret.replace('/', "%2f")),
        ];
        for url in out {
            assert_eq!(name(url), None, "{url}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("../secret", page.join("link")).unwrap();
            assert_eq!(name("/link"), None);
        }
    }

    #[test]
    fn names_that_others_gave_are_no_addresses() {
        for host in ["localhost", "localhost:8080", "127.0.0.1:1", "[::1]:8080", "192.168.0.1", "[::1]"] {
            assert!(is_address(host), "{host}");
        }
        for host in ["evil.example", "evil.example:8080", "localhost.evil.example", "", "127.0.0.1.evil.example:80"] {
            assert!(!is_address(host), "{host}");
        }
    }

    #[test]
    fn answers_say_what_they_are() {
        let site = site();
        let server = Server::http("127.0.0.1:0").unwrap();
        let address = server.server_addr().to_ip().unwrap();
        let page = site.path().join("page");
        std::thread::scope(|scope| {
            let running = scope.spawn(|| serve(&server, &page));
            let ask = |line: &str, host: &str| {
                let mut stream = TcpStream::connect(address).unwrap();
                write!(stream, "{line} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").unwrap();
                let mut text = String::new();
                stream.read_to_string(&mut text).unwrap();
                text
            };
            let found = ask("GET /a%20b.wasm", "localhost");
            assert!(found.starts_with("HTTP/1.0 200"), "{found}");
            for header in ["application/wasm", "Cross-Origin-Embedder-Policy: require-corp", "nosniff"] {
                assert!(found.contains(header), "{found}");
            }
            assert!(ask("GET /", "127.0.0.1").contains("text/html; charset=utf-8"));
            assert!(ask("GET /../secret", "127.0.0.1").starts_with("HTTP/1.0 404"));
            assert!(ask("POST /", "127.0.0.1").starts_with("HTTP/1.0 405"));
            assert!(ask("GET /", "evil.example").starts_with("HTTP/1.0 403"));
            server.unblock();
            running.join().unwrap();
        });
    }

    /// As browsers do: connections at once, each kept after its answer unless the answer ends it.
    #[test]
    fn every_connection_is_answered_while_others_are_kept() {
        const SERVERS: usize = 10;
        const ROUNDS: usize = 5;
        let site = site();
        let page = site.path().join("page");
        let mut answered = 0;
        for _ in 0..SERVERS {
            // Its first threads are those that connections wait for.
            let server = Server::http("127.0.0.1:0").unwrap();
            let address = server.server_addr().to_ip().unwrap();
            std::thread::scope(|scope| {
                scope.spawn(|| serve(&server, &page));
                for _ in 0..ROUNDS {
                    let mut streams: Vec<_> = (0..6).map(|_| TcpStream::connect(address).unwrap()).collect();
                    for stream in &mut streams {
                        stream.set_read_timeout(Some(Duration::from_secs(2))).unwrap();
                        write!(stream, "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
                    }
                    let mut kept = vec![];
                    for mut stream in streams {
                        let mut version = [0; 8];
                        answered += usize::from(stream.read_exact(&mut version).is_ok());
                        if version != *b"HTTP/1.0" {
                            kept.push(stream);
                        }
                    }
                    std::thread::sleep(Duration::from_millis(20));
                }
                server.unblock();
            });
        }
        assert_eq!(answered, SERVERS * ROUNDS * 6);
    }

    #[test]
    fn a_missing_page_names_the_remedy() {
        let said = page(Some(Path::new("no such folder"))).unwrap_err().to_string();
        assert!(said.contains("make web"), "{said}");
    }
}
