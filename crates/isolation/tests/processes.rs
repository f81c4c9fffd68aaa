//! Tests guests as what they are, other processes: this program starts itself.

use std::cell::Cell;
use std::process::{Command, ExitCode};

use isolation::{ChannelPacket, IsolatedGuest, NoAnswerReason, connect_to_host_process, is_host_alive};
use libtest_mimic::{Arguments, Trial};

#[path = "support/probe.rs"]
mod probe;

/// Numbers that may travel at once.
const NUMBERS: usize = 5;

fn main() -> ExitCode {
    let mut words = std::env::args().skip(1);
    match words.next().as_deref() {
        Some("guest") => {
            let host = words.next().and_then(|host| host.parse().ok()).expect("a number");
            serve(host);
            return ExitCode::SUCCESS;
        }
        Some(probe::PROBE) => {
            probe::serve_as_probe(words);
            return ExitCode::SUCCESS;
        }
        _ => {}
    }
    let test = |name: &str, body: fn()| {
        Trial::test(name, move || {
            body();
            Ok(())
        })
    };
    let tests = vec![
        test("numbers_and_bytes_of_any_length_come_back", numbers_and_bytes_of_any_length_come_back),
        test("an_end_is_told_and_stays", an_end_is_told_and_stays),
        test("a_guest_that_does_not_answer_is_ended", a_guest_that_does_not_answer_is_ended),
        test("the_note_of_a_guest_outlives_it", the_note_of_a_guest_outlives_it),
        test("a_guest_leaves_when_it_is_asked_to", a_guest_leaves_when_it_is_asked_to),
        test("nothing_leaves_the_sandbox", nothing_leaves_the_sandbox),
    ];
    libtest_mimic::run(&Arguments::from_args(), tests).exit_code()
}

/// Adds 1 to each number, and gives the bytes back in reverse; some words mean something.
fn serve(host: u32) {
    let (channel, note) = connect_to_host_process(host).expect("a host");
    let look = || if is_host_alive(host) { Ok(()) } else { Err("the host is gone") };
    let mut packet = ChannelPacket::default();
    loop {
        channel.receive(&mut packet, look).expect("a question");
        note[0].store(7, std::sync::atomic::Ordering::Relaxed);
        match packet.bytes.as_slice() {
            b"leave" => return,
            b"exit" => std::process::exit(5),
            b"sleep" => std::thread::sleep(std::time::Duration::from_secs(1000)),
            _ => {}
        }
        packet.numbers.iter_mut().for_each(|number| *number += 1.0);
        packet.bytes.reverse();
        channel.send(&packet.numbers, &packet.bytes, look).expect("a host");
    }
}

fn guest() -> IsolatedGuest {
    let mut command = Command::new(std::env::current_exe().expect("this program"));
    command.arg("guest");
    IsolatedGuest::start(command, NUMBERS, None).expect("a process")
}

/// As the user of now, and as nobody where that is root.
fn nothing_leaves_the_sandbox() {
    let root = rustix::process::getuid().is_root();
    let users = if root { vec![None, Some(65534)] } else { vec![None] };
    for user in users {
        let probe::ProbeReport { missing, attempts, changes } = probe::run_probe(user).expect("a probe");
        let succeeded: Vec<&str> =
            attempts.iter().filter(|it| it.succeeded).map(|it| it.name.as_str()).collect();
        assert!(attempts.len() > 200, "{}", attempts.len());
        // A machine that lacks a mechanism says so; what then succeeds is told, and no fault of this program.
        assert!(!missing.is_empty() || succeeded.is_empty(), "{user:?}: {succeeded:#?}");
        assert!(!missing.is_empty() || changes.is_empty(), "{user:?}: {changes:#?}");
    }
}

fn numbers_and_bytes_of_any_length_come_back() {
    let (mut guest, mut answer) = (guest(), ChannelPacket::default());
    let numbers = [0.0, -0.0, f64::NAN, f64::INFINITY, 1e-310];
    for length in [0, 1, 65_535, 65_536, 65_537, 1_000_000] {
        let bytes: Vec<u8> = (0..length).map(|place: u32| (place % 251) as u8).collect();
        for count in [0, NUMBERS] {
            guest.request_answer(&numbers[..count], &bytes, &mut answer, |_| false).expect("an answer");
            let same = answer
                .numbers
                .iter()
                .zip(&numbers)
                .all(|(got, sent)| got.to_bits() == (sent + 1.0).to_bits());
            assert!(same && answer.numbers.len() == count, "{:?}", answer.numbers);
            assert!(answer.bytes.iter().rev().eq(&bytes), "{length} bytes");
        }
    }
}

fn an_end_is_told_and_stays() {
    let (mut guest, mut answer) = (guest(), ChannelPacket::default());
    for _ in 0..2 {
        let Err(NoAnswerReason::Ended(status)) = guest.request_answer(&[], b"exit", &mut answer, |_| false)
        else {
            panic!("it answers");
        };
        assert_eq!(status.code(), Some(5));
    }
}

fn a_guest_that_does_not_answer_is_ended() {
    let (mut guest, mut answer, asked) = (guest(), ChannelPacket::default(), Cell::new(0));
    let patience = |_: &dyn Fn() -> _| asked.replace(asked.get() + 1) >= 3;
    assert_eq!(guest.request_answer(&[], b"sleep", &mut answer, patience), Err(NoAnswerReason::Cancelled));
    assert_eq!(asked.get(), 4);
    assert_eq!(guest.request_answer(&[], b"", &mut answer, |_| false), Err(NoAnswerReason::Cancelled));
}

fn the_note_of_a_guest_outlives_it() {
    let (mut guest, mut answer) = (guest(), ChannelPacket::default());
    assert_eq!(guest.last_note()[0], 0);
    guest.request_answer(&[], b"exit", &mut answer, |_| false).expect_err("it ends");
    assert_eq!(guest.last_note()[0], 7);
}

fn a_guest_leaves_when_it_is_asked_to() {
    let mut guest = guest();
    assert!(guest.shut_down(b"leave"));
    assert!(!self::guest().shut_down(b"exit"));
}
