//! Exchanges packets of numbers and bytes with the process at the other end, in turns.

use std::cell::Cell;
use std::sync::atomic::Ordering::SeqCst;
use std::time::{Duration, Instant};

use rustix::thread::futex::{self, Flags, Timespec};

use crate::memory::SharedMemory;

/// Who waits longer than this sleeps: being woken takes some ten microseconds.
const AWAKE: Duration = Duration::from_micros(100);
/// So often does a side look before it lets others have the core.
const SPINS: usize = 50;
/// A sleeper looks this often whether there is somebody to wait for.
const NAP: Timespec = Timespec { tv_sec: 0, tv_nsec: 10_000_000 };

/// Nobody has more to say at once [bytes].
const LONGEST: usize = 1 << 30;

/// A message: what travels at once.
#[derive(Debug, Default, Clone, PartialEq)]
pub struct ChannelPacket {
    /// Numbers, at most as many as the channel was made for.
    pub numbers: Vec<f64>,
    /// Bytes, as many as there are.
    pub bytes: Vec<u8>,
}

/// One end of a channel; the host begins.
#[derive(Debug)]
pub struct ProcessChannel {
    memory: SharedMemory,
    /// 0 for the host, 1 for the guest.
    side: usize,
    /// How long this side waited for its turn of late.
    expected_wait: Cell<Duration>,
}

impl ProcessChannel {
    pub(crate) fn new(memory: SharedMemory, side: usize) -> Self {
        ProcessChannel { memory, side, expected_wait: Cell::new(Duration::ZERO) }
    }

    /// The part of the memory that stays as it is while the two exchange messages, for what the guest is doing.
    pub(crate) fn shared_memory(&self) -> &SharedMemory {
        &self.memory
    }

    /// Sends, when it is this side's turn, and gives the turn to the other side. `look` is called now and then while this side waits.
    ///
    /// # Errors
    /// With that of `look`. The channel is of no use then.
    ///
    /// # Panics
    /// When there are more numbers than the channel was made for.
    pub fn send<E>(
        &self,
        numbers: &[f64],
        bytes: &[u8],
        mut look: impl FnMut() -> Result<(), E>,
    ) -> Result<(), E> {
        assert!(numbers.len() <= self.memory.numbers, "the line is made for fewer numbers");
        let mut rest = self.memory.write_message(numbers, bytes);
        self.pass_turn();
        while !rest.is_empty() {
            self.wait_for_turn(&mut look)?;
            rest = self.memory.write_message(numbers, rest);
            self.pass_turn();
        }
        Ok(())
    }

    /// Waits until it is this side's turn, and takes what the other side sent; false when that is nonsense.
    ///
    /// # Errors
    /// With that of `look`, which is called now and then. The channel is of no use then.
    pub fn receive<E>(
        &self,
        packet: &mut ChannelPacket,
        mut look: impl FnMut() -> Result<(), E>,
    ) -> Result<bool, E> {
        packet.bytes.clear();
        loop {
            self.wait_for_turn(&mut look)?;
            match self.memory.read_message(&mut packet.numbers, &mut packet.bytes) {
                None => return Ok(false),
                Some(true) if packet.bytes.len() > LONGEST => return Ok(false),
                Some(false) => return Ok(true),
                Some(true) => self.pass_turn(),
            }
        }
    }

    /// Gives the turn to the other side.
    fn pass_turn(&self) {
        let turn = self.memory.turn_counter();
        turn.store(turn.load(SeqCst).wrapping_add(1), SeqCst);
        if self.memory.sleep_flag(1 - self.side).load(SeqCst) != 0 {
            // Whoever sleeps looks by itself, too.
            let _ = futex::wake(turn, Flags::empty(), 1);
        }
    }

    /// Waits until it is this side's turn: awake where that was soon of late, else asleep at once, so that others have the core.
    fn wait_for_turn<E>(&self, look: &mut impl FnMut() -> Result<(), E>) -> Result<(), E> {
        let begin = Instant::now();
        let waited = match self.wait_awake(begin) {
            true => Ok(()),
            false => self.wait_asleep(look),
        };
        self.expected_wait.set((self.expected_wait.get() + begin.elapsed()) / 2);
        waited
    }

    fn is_my_turn(&self) -> bool {
        self.memory.turn_counter().load(SeqCst) as usize % 2 == self.side
    }

    /// Whether the turn came soon.
    fn wait_awake(&self, begin: Instant) -> bool {
        let longest = if self.expected_wait.get() > AWAKE { Duration::ZERO } else { AWAKE };
        loop {
            for _ in 0..SPINS {
                if self.is_my_turn() {
                    return true;
                }
                std::hint::spin_loop();
            }
            if begin.elapsed() > longest {
                return false;
            }
            // On a busy machine the other side may wait for this core.
            rustix::thread::sched_yield();
        }
    }

    fn wait_asleep<E>(&self, look: &mut impl FnMut() -> Result<(), E>) -> Result<(), E> {
        let (turn, asleep) = (self.memory.turn_counter(), self.memory.sleep_flag(self.side));
        loop {
            asleep.store(1, SeqCst);
            let seen = turn.load(SeqCst);
            if seen as usize % 2 == self.side {
                asleep.store(0, SeqCst);
                return Ok(());
            }
            let _ = futex::wait(turn, Flags::empty(), seen, Some(&NAP));
            asleep.store(0, SeqCst);
            if !self.is_my_turn() {
                look()?;
            }
        }
    }
}
