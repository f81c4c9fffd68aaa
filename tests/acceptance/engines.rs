//! Starts Slurm or HyperQueue on this machine for a test, kills parts of what they run, and ends all of it.

use std::collections::BTreeSet;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU16, Ordering};
use std::time::{Duration, Instant};

use super::harness::{Ended, Lab, signalled, wait_for, wait_until};
use super::python::python;

/// Longer than anything here takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// What runs chunks, in the folder of a lab. Nothing of it outlives the value.
pub struct Machines {
    pub lab: Lab,
    /// Variables of all processes; the first one has the folder of the lab, by which they are found.
    variables: Vec<(&'static str, String)>,
    daemons: Vec<(&'static str, Child)>,
}

/// A process of the lab: its number and its command line.
pub struct Process {
    pub number: u32,
    pub line: Vec<String>,
}

impl Process {
    /// The word behind another one of its command line.
    pub fn word_after(&self, word: &str) -> Option<&str> {
        let place = self.line.iter().position(|it| it == word)?;
        self.line.get(place + 1).map(String::as_str)
    }

    pub fn has(&self, words: &[&str]) -> bool {
        self.line.windows(words.len()).any(|window| window.iter().eq(words))
    }
}

/// Sends a signal to a process.
pub fn signal(number: u32, name: &str) {
    let _ = Command::new("kill").args([&format!("-{name}"), &number.to_string()]).status();
}

impl Machines {
    fn new(lab: Lab, variables: Vec<(&'static str, String)>) -> Self {
        Machines { lab, variables, daemons: Vec::new() }
    }

    /// A program that sees them.
    pub fn command(&self, program: impl AsRef<Path>) -> Command {
        let mut command = Command::new(program.as_ref());
        command.current_dir(self.lab.path("")).stdin(Stdio::null());
        command.envs(self.variables.iter().map(|(name, value)| (*name, value.as_str())));
        command
    }

    /// `trackside`, which sees them.
    pub fn trackside(&self, arguments: &[&str]) -> Command {
        let mut command = signalled(&self.lab.path(""));
        command.envs(self.variables.iter().map(|(name, value)| (*name, value.as_str())));
        command.args(arguments);
        command
    }

    /// Starts a program of the lab, whose output goes into a file.
    pub fn start(&self, mut command: Command, output: &str) -> Child {
        let file = std::fs::File::create(self.lab.path(output)).expect("a file");
        command.stdout(file.try_clone().expect("a file")).stderr(file);
        command.spawn().expect("it starts")
    }

    fn daemon(&mut self, name: &'static str, command: Command) {
        let child = self.start(command, &format!("{name}.out"));
        self.daemons.push((name, child));
    }

    /// All processes of the lab.
    pub fn processes(&self) -> Vec<Process> {
        let mark = self.lab.path("").to_string_lossy().trim_end_matches('/').as_bytes().to_owned();
        let all = std::fs::read_dir("/proc").expect("/proc").flatten();
        let numbers = all.filter_map(|it| it.file_name().to_str()?.parse::<u32>().ok());
        let ours = numbers.filter(|number| *number != std::process::id()).filter_map(|number| {
            let bytes = std::fs::read(format!("/proc/{number}/environ")).ok()?;
            bytes.windows(mark.len()).any(|window| window == mark).then_some(())?;
            let line = std::fs::read(format!("/proc/{number}/cmdline")).ok()?;
            let words = line.split(|byte| *byte == 0).filter(|word| !word.is_empty());
            let line = words.map(|word| String::from_utf8_lossy(word).into_owned()).collect();
            Some(Process { number, line })
        });
        ours.collect()
    }

    /// Ends a daemon by a signal, and waits for that.
    pub fn stop(&mut self, name: &str, by: &str) {
        let place = self.daemons.iter().position(|(it, _)| *it == name).expect("it runs");
        let (_, mut child) = self.daemons.remove(place);
        signal(child.id(), by);
        child.wait().expect("it ends");
    }
}

impl Drop for Machines {
    fn drop(&mut self) {
        for (_, child) in &mut self.daemons {
            let _ = child.kill();
        }
        // What is killed may have started something in between.
        let begin = Instant::now();
        loop {
            let left = self.processes();
            left.iter().for_each(|it| signal(it.number, "KILL"));
            for (_, child) in &mut self.daemons {
                let _ = child.wait();
            }
            if left.is_empty() || begin.elapsed() > PATIENCE {
                break;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

/// A port that nobody listens at, below those that systems give to connections: one of these may be taken before a daemon listens.
fn free_port() -> Result<u16, String> {
    static NEXT: AtomicU16 = AtomicU16::new(0);
    let first = 10_000 + 20 * (std::process::id() % 1_000) as u16;
    let mut ports = (0..100).map(|_| first + NEXT.fetch_add(1, Ordering::Relaxed));
    let free = ports.find(|port| TcpListener::bind(("127.0.0.1", *port)).is_ok());
    free.ok_or_else(|| "no port is free".to_owned())
}

/// A Slurm of one machine with two cores, in a lab.
///
/// # Errors
/// With the reason when it does not start.
pub fn slurm(lab: Lab) -> Result<Machines, String> {
    let at = |name: &str| lab.path(name).to_string_lossy().into_owned();
    let output = |command: &mut Command| {
        let output = command.output().map_err(|error| error.to_string())?;
        Ok::<_, String>(String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let host = output(Command::new("hostname").arg("-s"))?;
    let [controller, node] = [(); 2].map(|()| free_port());
    let text = include_str!("slurm.conf").replace("HOST", &host).replace("FOLDER", &at(""));
    let text = text.replace("PORT1", &controller?.to_string());
    lab.write("slurm.conf", text.replace("PORT2", &node?.to_string()));
    // Made for this test; whoever reads it can do nothing with it later.
    let key = lab.write("munge.key", lab.path("").to_string_lossy().repeat(40));
    std::fs::set_permissions(&key, std::os::unix::fs::PermissionsExt::from_mode(0o400))
        .map_err(|error| error.to_string())?;
    let variables = vec![("SLURM_CONF", at("slurm.conf"))];
    let mut machines = Machines::new(lab, variables);
    let mut munged = machines.command("munged");
    munged.args(["--foreground", "--force"]);
    for (option, name) in [
        ("key-file", "munge.key"),
        ("socket", "munge.socket"),
        ("pid-file", "munge.pid"),
        ("log-file", "munge.log"),
        ("seed-file", "munge.seed"),
    ] {
        munged.arg(format!("--{option}={}", machines.lab.path(name).display()));
    }
    machines.daemon("munged", munged);
    wait_for("munged listens", || machines.lab.has("munge.socket"))?;
    let mut controller = machines.command("slurmctld");
    controller.arg("-D");
    machines.daemon("slurmctld", controller);
    machines.start_node();
    machines.wait_for_node()?;
    Ok(machines)
}

impl Machines {
    /// Starts the daemon of the machine that runs tasks of Slurm.
    pub fn start_node(&mut self) {
        let mut node = self.command("slurmd");
        node.arg("-D");
        self.daemon("slurmd", node);
    }

    /// Waits until it takes tasks.
    fn wait_for_node(&mut self) -> Result<(), String> {
        let mut said = String::new();
        wait_for("Slurm starts", || {
            let mut sinfo = self.command("sinfo");
            let output = sinfo.args(["--noheader", "--format=%t"]).output();
            said = output.map(|it| String::from_utf8_lossy(&it.stdout).into_owned()).unwrap_or_default();
            let ended = |(_, child): &mut (_, Child)| !matches!(child.try_wait(), Ok(None));
            said.trim() == "idle" || self.daemons.iter_mut().any(ended)
        })?;
        match said.trim() {
            "idle" => Ok(()),
            _ => {
                let logs = ["slurmctld.out", "slurmd.out", "munged.out"].map(|it| self.lab.read(it));
                Err(format!("a daemon of Slurm ended: {}", logs.join(" ")))
            }
        }
    }

    /// Starts a server of HyperQueue with a worker of two cores.
    pub fn start_server(&mut self) {
        let _ = std::fs::remove_file(self.lab.path("server/ready"));
        let mut server = self.command(self.lab.path("bin/hq"));
        server.args(["serve", "2"]);
        self.daemon("server", server);
        wait_until("HyperQueue starts", || self.lab.has("server/ready"));
    }

    /// Kills a chunk that runs and that was not killed before: its script, its process, or its worker.
    pub fn kill_a_chunk(&self, killed: &mut BTreeSet<String>, random: &mut Random) {
        let all = self.processes();
        let runs = |it: &&Process| it.has(&["sweep", "run"]) && it.line[0].ends_with("trackside");
        let open = all
            .iter()
            .filter(runs)
            .filter(|it| it.word_after("--chunk").is_some_and(|chunk| !killed.contains(chunk)));
        let open: Vec<_> = open.collect();
        if open.is_empty() {
            return;
        }
        let chosen = open[random.below(open.len())];
        killed.extend(chosen.word_after("--chunk").map(str::to_owned));
        let number = chosen.number.to_string();
        let worker = all.iter().find(|it| it.has(&["sweep", "worker", &number]));
        let script = parent(chosen.number);
        let target = [Some(chosen.number), worker.map(|it| it.number), script][random.below(3)];
        signal(target.unwrap_or(chosen.number), "KILL");
    }
}

fn parent(number: u32) -> Option<u32> {
    let text = std::fs::read_to_string(format!("/proc/{number}/status")).ok()?;
    text.lines().find_map(|line| line.strip_prefix("PPid:"))?.trim().parse().ok()
}

/// A HyperQueue on this machine, in a lab: server and worker of the package, and a stand-in for the program `hq`.
pub fn hyperqueue(lab: Lab) -> Machines {
    let folder: PathBuf = lab.path("server");
    std::fs::create_dir_all(&folder).expect("a folder");
    let program = python().script("hq.py");
    let text = format!("#!/bin/sh\nexec {program} '{}' \"$@\"\n", folder.display());
    let hq = lab.write("bin/hq", text);
    std::fs::set_permissions(&hq, std::os::unix::fs::PermissionsExt::from_mode(0o755)).expect("a program");
    let path = std::env::var("PATH").unwrap_or_default();
    let path = format!("{}:{path}", lab.path("bin").display());
    let mut machines = Machines::new(lab, vec![("PATH", path)]);
    machines.start_server();
    machines
}

/// A seeded stream of numbers: xorshift64.
pub struct Random(pub u64);

impl Random {
    pub fn below(&mut self, end: usize) -> usize {
        for shift in [13, -7, 17] {
            self.0 ^= if shift > 0 { self.0 << shift } else { self.0 >> -shift };
        }
        (self.0 >> 33) as usize % end
    }
}

/// Why Slurm does not start here, if it does not.
pub fn missing_slurm() -> Option<String> {
    for program in ["munged", "slurmctld", "slurmd", "sbatch", "squeue"] {
        let found = Command::new(program).arg("--version").output();
        if found.is_err() {
            return Some(format!("{program} is not installed, which runs sweeps as job arrays"));
        }
    }
    slurm(Lab::new()).err().map(|reason| format!("Slurm does not start here: {reason}"))
}

/// Insists on an end with this code.
pub fn ends_with(mut child: Child, code: i32, output: &str, lab: &Lab) {
    let status = child.wait().expect("it ends");
    assert_eq!(status.code(), Some(code), "{}", lab.read(output));
}

/// What a command says.
pub fn said(mut command: Command) -> Ended {
    Ended::of(command.output().expect("it starts"))
}
