//! A browser, driven over its own protocol (Chrome DevTools Protocol): the dozen of its commands that pages' tests need.

use anyhow::{Context, anyhow, bail};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::rc::Rc;
use std::time::{Duration, Instant};
use tungstenite::{Message, WebSocket};

/// Names of browsers that speak it.
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];
/// Longest wait for anything.
const PATIENCE: Duration = Duration::from_secs(60);

/// A browser of this machine; none: there is none.
pub fn find() -> Option<PathBuf> {
    let folders = std::env::var_os("PATH")?;
    let files = NAMES.iter().flat_map(|name| std::env::split_paths(&folders).map(move |f| f.join(name)));
    files.into_iter().find(|file| file.is_file())
}

/// What a page loaded, and what went wrong in it.
#[derive(Clone, Debug, Default)]
pub struct Traffic {
    /// Bytes that came over the network.
    pub bytes: u64,
    /// Events that the server sent.
    pub events: u64,
    /// Addresses asked for, other than of the page's own host.
    pub outward: Vec<String>,
    /// Exceptions, and what the browser complained of.
    pub complaints: Vec<String>,
}

struct Wire {
    socket: WebSocket<TcpStream>,
    calls: u64,
    host: String,
    traffic: BTreeMap<String, Traffic>,
}

impl Wire {
    fn call(&mut self, session: Option<&str>, method: &str, params: &Value) -> anyhow::Result<Value> {
        self.calls += 1;
        let mut message = json!({"id": self.calls, "method": method, "params": params});
        if let Some(session) = session {
            message["sessionId"] = session.into();
        }
        self.socket.send(Message::text(message.to_string()))?;
        loop {
            let message =
                self.socket.read().with_context(|| format!("the browser is silent after {method}"))?;
            let Message::Text(text) = message else { continue };
            let mut told: Value = serde_json::from_str(&text)?;
            if told["id"] != self.calls {
                self.happened(&told);
            } else if told["error"].is_null() {
                return Ok(told["result"].take());
            } else {
                bail!("{method}: {}", told["error"]["message"]);
            }
        }
    }

    fn happened(&mut self, told: &Value) {
        let Some(session) = told["sessionId"].as_str() else { return };
        let traffic = self.traffic.entry(session.into()).or_default();
        let params = &told["params"];
        match told["method"].as_str().unwrap_or_default() {
            "Network.requestWillBeSent" => {
                let url = params["request"]["url"].as_str().unwrap_or_default();
                let is_own = url.strip_prefix("http://").is_some_and(|rest| rest.starts_with(&self.host));
                if !is_own && !url.starts_with("data:") && !url.starts_with("blob:") {
                    traffic.outward.push(url.into());
                }
            }
            "Network.responseReceived" => {
                let response = &params["response"];
                let is_kept = response["fromDiskCache"] == true || response["fromServiceWorker"] == true;
                let bytes = response["encodedDataLength"].as_f64().filter(|_| !is_kept);
                traffic.bytes += bytes.unwrap_or_default() as u64;
            }
            "Network.dataReceived" => traffic.bytes += params["encodedDataLength"].as_u64().unwrap_or(0),
            "Network.eventSourceMessageReceived" => traffic.events += 1,
            "Runtime.exceptionThrown" => {
                traffic.complaints.push(params["exceptionDetails"]["exception"]["description"].to_string());
            }
            // What the network refuses while it is away is told by the page.
            "Log.entryAdded"
                if params["entry"]["source"] != "network" && params["entry"]["level"] == "error" =>
            {
                traffic.complaints.push(params["entry"]["text"].to_string());
            }
            _ => {}
        }
    }
}

/// A browser without a window, gone when dropped.
pub struct Browser {
    child: Child,
    profile: PathBuf,
    wire: Rc<RefCell<Wire>>,
}

impl Browser {
    /// Starts one with an empty profile; pages are to load from `host` alone.
    ///
    /// # Errors
    /// If it does not start, or does not say where it listens.
    pub fn start(program: &Path, host: &str) -> anyhow::Result<Self> {
        let profile = std::env::temp_dir().join(format!("toponym-browser-{}", std::process::id()));
        std::fs::create_dir_all(&profile)?;
        let child = Command::new(program)
            // The machine is a test's: its user may be root, and its shared memory small.
            .args([
                "--headless",
                "--no-sandbox",
                "--disable-dev-shm-usage",
                "--disable-gpu",
                "--hide-scrollbars",
            ])
            .args(["--no-first-run", "--disable-background-networking", "--disable-component-update"])
            .args(["--disable-sync", "--disable-features=Translate,OptimizationHints,MediaRouter"])
            .args(["--remote-debugging-port=0", "about:blank"])
            .arg(format!("--user-data-dir={}", profile.display()))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .with_context(|| program.display().to_string())?;
        let (port, path) = listens(&profile)?;
        let stream = TcpStream::connect(("127.0.0.1", port))?;
        stream.set_read_timeout(Some(PATIENCE))?;
        let (socket, _) = tungstenite::client(format!("ws://127.0.0.1:{port}{path}"), stream)
            .map_err(|e| anyhow!("the browser does not speak: {e}"))?;
        let wire = Wire { socket, calls: 0, host: host.into(), traffic: BTreeMap::new() };
        Ok(Self { child, profile, wire: Rc::new(RefCell::new(wire)) })
    }

    /// A page of a browser that knows nothing of the others', `width` × `height` pixels large.
    ///
    /// # Errors
    /// The browser's.
    pub fn page(&self, width: u32, height: u32) -> anyhow::Result<Page> {
        let call = |method, params| self.wire.borrow_mut().call(None, method, &params);
        let context = call("Target.createBrowserContext", json!({}))?;
        let target = call(
            "Target.createTarget",
            json!({"url": "about:blank", "browserContextId": context["browserContextId"]}),
        )?;
        let attached =
            call("Target.attachToTarget", json!({"targetId": target["targetId"], "flatten": true}))?;
        let session = attached["sessionId"].as_str().context("no session")?.to_owned();
        let page = Page { wire: self.wire.clone(), session };
        for domain in ["Page", "Runtime", "Log", "Network", "Performance"] {
            page.call(&format!("{domain}.enable"), &json!({}))?;
        }
        let metrics =
            json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600});
        page.call("Emulation.setDeviceMetricsOverride", &metrics)?;
        Ok(page)
    }
}

/// Where a browser that has just been started says that it listens.
fn listens(profile: &Path) -> anyhow::Result<(u16, String)> {
    let begin = Instant::now();
    loop {
        let told = std::fs::read_to_string(profile.join("DevToolsActivePort")).unwrap_or_default();
        if let Some((port, path)) = told.split_once('\n').and_then(|(p, path)| Some((p.parse().ok()?, path)))
        {
            return Ok((port, path.trim().to_owned()));
        }
        if begin.elapsed() > PATIENCE {
            bail!("the browser did not start within {} s", PATIENCE.as_secs());
        }
        std::thread::sleep(Duration::from_millis(50));
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.wire.borrow_mut().call(None, "Browser.close", &json!({}));
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = std::fs::remove_dir_all(&self.profile);
    }
}

/// A page of it.
pub struct Page {
    wire: Rc<RefCell<Wire>>,
    session: String,
}

impl Page {
    fn call(&self, method: &str, params: &Value) -> anyhow::Result<Value> {
        self.wire.borrow_mut().call(Some(&self.session), method, params)
    }

    /// Runs a script in it before any of its own.
    ///
    /// # Errors
    /// The browser's.
    pub fn prepare(&self, script: &str) -> anyhow::Result<()> {
        self.call("Page.addScriptToEvaluateOnNewDocument", &json!({"source": script})).map(drop)
    }

    /// Opens an address, and waits until it is loaded.
    ///
    /// # Errors
    /// If nobody answers there, or not within a minute.
    pub fn open(&self, address: &str) -> anyhow::Result<()> {
        let opened = self.call("Page.navigate", &json!({"url": address}))?;
        if let Some(error) = opened["errorText"].as_str() {
            bail!("{address}: {error}");
        }
        self.until("document.readyState === 'complete'", address)
    }

    /// The value of an expression, awaited if it is a promise.
    ///
    /// # Errors
    /// What it throws.
    pub fn eval(&self, expression: &str) -> anyhow::Result<Value> {
        let params = json!({"expression": expression, "awaitPromise": true, "returnByValue": true,
            "userGesture": true});
        let mut result = self.call("Runtime.evaluate", &params)?;
        if !result["exceptionDetails"].is_null() {
            bail!("{expression}: {}", result["exceptionDetails"]["exception"]["description"]);
        }
        Ok(result["result"]["value"].take())
    }

    /// Waits until an expression holds.
    ///
    /// # Errors
    /// If it does not within a minute.
    pub fn until(&self, expression: &str, what: &str) -> anyhow::Result<()> {
        let begin = Instant::now();
        // A page that is being left forgets what it was asked.
        while !self.eval(&format!("Boolean({expression})")).is_ok_and(|holds| holds == true) {
            if begin.elapsed() > PATIENCE {
                let text = self.eval("document.body?.innerText").unwrap_or_default();
                bail!("{what}: not within {} s; the page tells {text}", PATIENCE.as_secs());
            }
            std::thread::sleep(Duration::from_millis(30));
        }
        Ok(())
    }

    /// Types into a field, and presses Enter.
    ///
    /// # Errors
    /// If there is no such field.
    pub fn enter(&self, selector: &str, text: &str) -> anyhow::Result<()> {
        self.eval(&format!("document.querySelector({selector:?}).focus()"))?;
        self.call("Input.insertText", &json!({"text": text}))?;
        let key = |kind| {
            json!({"type": kind, "key": "Enter", "code": "Enter", "windowsVirtualKeyCode": 13,
            "text": "\r"})
        };
        self.call("Input.dispatchKeyEvent", &key("keyDown"))?;
        self.call("Input.dispatchKeyEvent", &key("keyUp")).map(drop)
    }

    /// Presses the mouse on an element's middle, `"mousePressed"`, or lets go, `"mouseReleased"`.
    ///
    /// # Errors
    /// If there is no such element.
    pub fn mouse(&self, selector: &str, kind: &str) -> anyhow::Result<()> {
        let at = self.eval(&format!(
            "(() => {{ const e = document.querySelector({selector:?}); e.scrollIntoView({{ block: 'nearest' }});
             const b = e.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; }})()"
        ))?;
        let params = json!({"type": kind, "x": at[0], "y": at[1], "button": "left", "clickCount": 1});
        self.call("Input.dispatchMouseEvent", &params).map(drop)
    }

    /// Clicks an element.
    ///
    /// # Errors
    /// As [`Page::mouse`].
    pub fn click(&self, selector: &str) -> anyhow::Result<()> {
        self.mouse(selector, "mousePressed")?;
        self.mouse(selector, "mouseReleased")
    }

    /// Takes the network away, or gives it back.
    ///
    /// # Errors
    /// The browser's.
    pub fn offline(&self, is: bool) -> anyhow::Result<()> {
        let params = json!({"offline": is, "latency": 0, "downloadThroughput": -1, "uploadThroughput": -1});
        self.call("Network.emulateNetworkConditions", &params).map(drop)
    }

    /// Loads it anew.
    ///
    /// # Errors
    /// If that fails.
    pub fn reload(&self) -> anyhow::Result<()> {
        self.eval("globalThis.isOld = true")?;
        self.call("Page.reload", &json!({}))?;
        self.until("document.readyState === 'complete' && !globalThis.isOld", "the page again")
    }

    /// In dark colours, or in light ones.
    ///
    /// # Errors
    /// The browser's.
    pub fn dark(&self, is: bool) -> anyhow::Result<()> {
        let value = if is { "dark" } else { "light" };
        let params = json!({"features": [{"name": "prefers-color-scheme", "value": value}]});
        self.call("Emulation.setEmulatedMedia", &params).map(drop)
    }

    /// What it looks like, PNG.
    ///
    /// # Errors
    /// The browser's.
    pub fn picture(&self) -> anyhow::Result<Vec<u8>> {
        let shot = self.call("Page.captureScreenshot", &json!({"format": "png"}))?;
        Ok(STANDARD.decode(shot["data"].as_str().unwrap_or_default())?)
    }

    /// Seconds that its scripts have run.
    ///
    /// # Errors
    /// The browser's.
    pub fn script_s(&self) -> anyhow::Result<f64> {
        let told = self.call("Performance.getMetrics", &json!({}))?;
        let metrics = told["metrics"].as_array().context("no metrics")?;
        let found = metrics.iter().find(|m| m["name"] == "ScriptDuration");
        found.and_then(|m| m["value"].as_f64()).context("no ScriptDuration")
    }

    /// What it has loaded so far.
    ///
    /// # Errors
    /// The browser's.
    pub fn traffic(&self) -> anyhow::Result<Traffic> {
        // Whatever was told before is read with the answer.
        self.eval("0")?;
        Ok(self.wire.borrow().traffic.get(&self.session).cloned().unwrap_or_default())
    }
}
