//! A debugger on the emulated processor, for breaking a program that has no way to break itself.
//!
//! QEMU speaks GDB's remote protocol: `$data#checksum`, each answered by `+` and a packet.

use std::io::{Read, Write};
use std::net::TcpStream;

use crate::machine::HOPELESS;

/// A connection to QEMU's stub. The processor does not move while it is open.
#[derive(Debug)]
pub struct Debugger(TcpStream);

impl Debugger {
    /// Stops the processor.
    ///
    /// # Panics
    /// When QEMU does not listen there.
    pub fn attach(port: u16) -> Self {
        let stream = TcpStream::connect(("127.0.0.1", port)).expect("QEMU's debugging port");
        stream.set_read_timeout(Some(HOPELESS)).expect("a stream");
        // Many small packets, each of which waits for its answer.
        stream.set_nodelay(true).expect("a stream");
        let mut debugger = Self(stream);
        debugger.ask("?");
        debugger
    }

    fn ask(&mut self, data: &str) -> String {
        let sum = data.bytes().fold(0_u8, u8::wrapping_add);
        self.0.write_all(format!("${data}#{sum:02x}").as_bytes()).expect("QEMU listens");
        loop {
            let answer = self.packet();
            // That it has stopped may be reported once more, whenever it likes.
            if data == "?" || !answer.starts_with(['T', 'S']) {
                return answer;
            }
        }
    }

    fn packet(&mut self) -> String {
        let mut answer = String::new();
        let mut byte = [0];
        let mut check = 0;
        // Everything up to the packet's end and the two digits behind it.
        while check < 2 {
            self.0.read_exact(&mut byte).expect("QEMU answers");
            check += u8::from(answer.contains('#'));
            answer.push(char::from(byte[0]));
        }
        self.0.write_all(b"+").expect("QEMU listens");
        let begin = answer.find('$').map_or(0, |at| at + 1);
        let end = answer.find('#').unwrap_or(answer.len());
        answer[begin..end].to_owned()
    }

    /// A word of memory.
    ///
    /// # Panics
    /// When it cannot be read.
    pub fn word(&mut self, address: u32) -> u32 {
        let digits = self.ask(&format!("m{address:x},4"));
        u32::from_str_radix(&digits, 16).expect("four bytes").swap_bytes()
    }

    /// Puts two bytes of code at an address.
    ///
    /// # Panics
    /// When QEMU refuses.
    pub fn patch(&mut self, address: u32, code: u16) {
        let answer = self.ask(&format!("M{address:x},2:{:04x}", code.swap_bytes()));
        assert_eq!(answer, "OK");
    }

    /// Lets the processor continue.
    pub fn detach(mut self) {
        self.ask("D");
    }
}
