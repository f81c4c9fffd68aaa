//! Measures a question and its answer: `cargo run --release -p isolation --example round_trips -- QUESTIONS NUMBERS GUESTS`.

use std::process::Command;
use std::time::Instant;

use isolation::{ChannelPacket, IsolatedGuest, connect_to_host_process, is_host_alive};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |place: usize, otherwise: usize| -> Result<usize, std::num::ParseIntError> {
        arguments.get(place).map_or(Ok(otherwise), |text| text.parse())
    };
    if arguments.first().is_some_and(|word| word == "guest") {
        return answer(u32::try_from(number(1, 0)?)?);
    }
    let (questions, numbers) = (number(0, 1_000_000)?, number(1, 10)?);
    let start = |_| {
        let mut command = Command::new(std::env::current_exe()?);
        command.arg("guest");
        IsolatedGuest::start(command, numbers, None)
    };
    let mut guests = (0..number(2, 1)?).map(start).collect::<Result<Vec<_>, _>>()?;
    let (mut row, mut packet) = (vec![0.0; numbers], ChannelPacket::default());
    let mut times = Vec::with_capacity(questions);
    for place in (0..guests.len()).cycle().take(questions) {
        let begin = Instant::now();
        guests[place].request_answer(&row, &[1, 2, 3], &mut packet, |_| false)?;
        times.push(begin.elapsed());
        row.clone_from(&packet.numbers);
    }
    times.sort();
    let quantile = |share: f64| times[(share * (times.len() - 1) as f64) as usize].as_secs_f64() * 1e6;
    let mean = times.iter().map(|time| time.as_secs_f64()).sum::<f64>() / times.len() as f64 * 1e6;
    println!(
        "{questions} questions of {numbers} numbers: mean {mean:.2} us, median {:.2} us, 99 % {:.2} us, longest {:.0} us",
        quantile(0.5),
        quantile(0.99),
        quantile(1.0)
    );
    println!("the last answer has {:?}", row.first());
    guests.iter_mut().for_each(|guest| {
        guest.shut_down(&[]);
    });
    Ok(())
}

fn answer(host: u32) -> Result<(), Box<dyn std::error::Error>> {
    let (channel, _) = connect_to_host_process(host)?;
    let look = || if is_host_alive(host) { Ok(()) } else { Err("the host is gone") };
    let mut packet = ChannelPacket::default();
    loop {
        channel.receive(&mut packet, look)?;
        if packet.bytes.is_empty() {
            return Ok(());
        }
        packet.numbers.iter_mut().for_each(|number| *number += 1.0);
        channel.send(&packet.numbers, &packet.bytes, look)?;
    }
}
