//! The link over USB: a serial port (CDC-ACM) at the board's USB socket, beside the UART.
//!
//! Two tasks move packets while the loop sleeps, a third one answers the host. Bytes lie in queues in between: a poll waits for no host.

use core::hint::black_box;
use core::sync::atomic::{AtomicBool, Ordering};

use embassy_executor::Spawner;
use embassy_rp::Peri;
use embassy_rp::interrupt::typelevel::{Binding, USBCTRL_IRQ};
use embassy_rp::peripherals::USB;
use embassy_rp::usb::{Driver, InterruptHandler};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;
use embassy_sync::signal::Signal;
use embassy_usb::class::cdc_acm::{CdcAcmClass, Receiver, Sender, State};
use embassy_usb::{Builder, Config, Handler, UsbDevice};
use sonarfix_app::Link;
use sonarfix_app::two_links::Pluggable;

/// Identifiers of a serial port of a program on this chip: vendor Raspberry Pi, product "Pico SDK CDC UART"
/// (<https://github.com/raspberrypi/usb-pid>).
const IDENTIFIERS: (u16, u16) = (0x2E8A, 0x000A);
/// Bytes of a packet of full speed.
const PACKET: usize = 64;
/// Bytes of a packet to the host. One that is full would be followed by an empty one.
const SHORT: usize = PACKET - 1;

/// A poll sends at most 400 bytes.
static TO_SEND: Pipe<CriticalSectionRawMutex, 512> = Pipe::new();
/// While it is full, the host waits.
static ARRIVED: Pipe<CriticalSectionRawMutex, 256> = Pipe::new();
/// Whether a host has configured the port and does not let it sleep. An unplugged one sleeps: its line is silent.
static IS_PLUGGED: AtomicBool = AtomicBool::new(false);

/// Whether what is in the queue was for an earlier host.
static HAS_NEW_HOST: AtomicBool = AtomicBool::new(false);

type Usb = Driver<'static, USB>;
/// Tells the loop that bytes have arrived.
type Received = &'static Signal<CriticalSectionRawMutex, ()>;

// Functions of the driver that are not inlined: their lines that can panic remain those of the driver (`cargo xtask boards`).
type Bytes = &'static mut [u8];
const BUILDER: fn(Usb, Config<'static>, Bytes, Bytes, Bytes, Bytes) -> Builder<'static, Usb> =
    Builder::new;
type Class = CdcAcmClass<'static, Usb>;
const CLASS: fn(&mut Builder<'static, Usb>, &'static mut State<'static>, u16) -> Class = Class::new;
const DEVICE: fn(Builder<'static, Usb>) -> UsbDevice<'static, Usb> = Builder::build;

/// What the driver needs as long as the program runs.
pub struct Memory {
    configuration: [u8; 128],
    control: [u8; PACKET],
    state: State<'static>,
    presence: Presence,
}

impl Memory {
    pub const fn new() -> Self {
        Self {
            configuration: [0; 128],
            control: [0; PACKET],
            state: State::new(),
            presence: Presence,
        }
    }
}

/// Notes whether the port is plugged.
struct Presence;

impl Handler for Presence {
    fn reset(&mut self) {
        IS_PLUGGED.store(false, Ordering::Relaxed);
    }

    fn configured(&mut self, is_configured: bool) {
        HAS_NEW_HOST.store(true, Ordering::Relaxed);
        IS_PLUGGED.store(is_configured, Ordering::Relaxed);
    }

    fn suspended(&mut self, is_suspended: bool) {
        IS_PLUGGED.store(!is_suspended, Ordering::Relaxed);
    }
}

/// Starts the port.
// Inlined, its stack frame would be part of that of the start.
#[inline(never)]
pub fn start(
    spawner: Spawner,
    usb: Peri<'static, USB>,
    interrupts: impl Binding<USBCTRL_IRQ, InterruptHandler<USB>>,
    memory: &'static mut Memory,
    received: Received,
) {
    let (vendor, product) = IDENTIFIERS;
    let mut config = Config::new(vendor, product);
    (config.manufacturer, config.product) = (Some("Sonarfix"), Some("Sonarfix robot"));
    config.self_powered = true;
    let driver = Driver::new(usb, interrupts);
    let Memory { configuration, control, state, presence } = memory;
    let mut builder = black_box(BUILDER)(driver, config, configuration, &mut [], &mut [], control);
    builder.handler(presence);
    let class = black_box(CLASS)(&mut builder, state, 64);
    let device = black_box(DEVICE)(builder);
    let (sender, receiver) = class.split();
    // Each task is spawned once, for which there is room.
    if let Ok(serves) = serves(device) {
        spawner.spawn(serves);
    }
    if let Ok(sends) = sends(sender) {
        spawner.spawn(sends);
    }
    if let Ok(receives) = receives(receiver, received) {
        spawner.spawn(receives);
    }
}

/// Answers the host.
#[embassy_executor::task]
async fn serves(mut device: UsbDevice<'static, Usb>) -> ! {
    device.run().await
}

/// Sends what is in the queue, which is empty until the port is plugged.
#[embassy_executor::task]
async fn sends(mut sender: Sender<'static, Usb>) -> ! {
    let mut packet = [0; SHORT];
    loop {
        let length = TO_SEND.read(&mut packet).await;
        if HAS_NEW_HOST.load(Ordering::Relaxed) {
            HAS_NEW_HOST.store(false, Ordering::Relaxed);
            TO_SEND.clear();
            continue;
        }
        // A packet that does not go through was for a host that is gone.
        let _ = sender.write_packet(packet.get(..length).unwrap_or_default()).await;
    }
}

/// Receives into the queue.
#[embassy_executor::task]
async fn receives(mut receiver: Receiver<'static, Usb>, received: Received) -> ! {
    let mut packet = [0; PACKET];
    loop {
        if let Ok(length) = receiver.read_packet(&mut packet).await {
            ARRIVED.write_all(packet.get(..length).unwrap_or_default()).await;
            received.signal(());
        }
    }
}

/// The loop's end of the port.
pub struct UsbLink;

impl Link for UsbLink {
    fn receive(&mut self) -> Option<u8> {
        let mut byte = [0];
        ARRIVED.try_read(&mut byte).ok()?;
        let [byte] = byte;
        Some(byte)
    }

    fn send(&mut self, frame: &[u8]) {
        if !self.has_room(frame.len()) {
            return;
        }
        let mut rest = frame;
        // A queue that ends in the middle of its memory takes a frame in two parts.
        while let Some((_, after)) =
            TO_SEND.try_write(rest).ok().and_then(|written| rest.split_at_checked(written))
            && !after.is_empty()
        {
            rest = after;
        }
    }

    fn has_room(&self, length: usize) -> bool {
        self.is_plugged() && TO_SEND.free_capacity() >= length
    }
}

impl Pluggable for UsbLink {
    fn is_plugged(&self) -> bool {
        IS_PLUGGED.load(Ordering::Relaxed)
    }

    fn has_received(&self) -> bool {
        !ARRIVED.is_empty()
    }

    fn drop_received(&mut self) {
        ARRIVED.clear();
    }
}
