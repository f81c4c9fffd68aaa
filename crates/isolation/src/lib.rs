//! Talks with a process of its own through shared memory: what crashes, hangs or exits there does so alone.
//!
//! The host starts an [`IsolatedGuest`], and sends it a question. The guest, which has its end of the [`ProcessChannel`], answers. A question and an
//! answer are numbers and bytes; both are memory copies, and a doorbell (a futex) says whose turn it is. Nothing else connects the
//! two, so a guest that closes all its descriptors can go on.
//!
//! The host believes nothing that the guest writes. The guest ends with its host, however that ends.
//!
//! # Platforms
//! Linux. Elsewhere [`IsolatedGuest::start`] says that it is not possible.
#![cfg_attr(not(target_os = "linux"), expect(dead_code))]

mod channel;
mod guest;
mod memory;
mod sandbox;
mod sandboxed_command;

pub use channel::{ChannelPacket, ProcessChannel};
pub use guest::{
    IsolatedGuest, NoAnswerReason, OutputHandler, OutputStream, connect_to_host_process, is_host_alive,
};
pub use memory::NOTE;
pub use sandbox::{ProcessLimits, ProtectionMechanism, Sandbox, enter_sandbox};
pub use sandboxed_command::{become_sandboxed_command, sandbox_entrance, set_sandbox_entrance};
