//! Division of 64 bits: the function that the compiler calls by this name, in fifty bytes. The one that comes with it is fast and takes
//! over a kilobyte; here nothing divides so often that it would be noticed.

core::arch::global_asm!(
    ".syntax unified",
    ".thumb",
    // Dividend r0 and r1, divisor r2 and r3; quotient in r0 and r1, remainder in r2 and r3. The dividend moves out of r1 into the
    // remainder bit by bit, and the quotient's bits move into r0. Division by zero gives a quotient of ones.
    ".section .text.pam_uldivmod,\"ax\",%progbits",
    ".global __aeabi_uldivmod",
    ".type __aeabi_uldivmod,%function",
    ".thumb_func",
    "__aeabi_uldivmod:",
    "push {{r4, r5, r6, r7, r8, lr}}",
    "mov r4, r2",
    "mov r5, r3",
    "movs r2, #0",
    "movs r3, #0",
    "movs r6, #64",
    "1:",
    "adds r0, r0, r0",
    "adcs r1, r1, r1",
    "adcs r2, r2, r2",
    "adcs r3, r3, r3",
    // A bit that left the remainder makes it larger than any divisor.
    "bcs 2f",
    "cmp r2, r4",
    "sbcs r7, r3, r5",
    "blo 3f",
    "2:",
    "subs r2, r2, r4",
    "sbcs r3, r3, r5",
    "adds r0, r0, #1",
    "3:",
    "subs r6, #1",
    "bne 1b",
    "pop {{r4, r5, r6, r7, r8, pc}}",
    ".size __aeabi_uldivmod, . - __aeabi_uldivmod",
    ".text",
);
