//! The application: tasks and their priorities. What they do stands in the
//! library, what they touch in `board/`.
//!
//! | task | priority | deadline | when missed |
//! |---|---:|---|---|
//! | control | 4 | the next sample | the sample's number skips ahead, which the next tick sees |
//! | receive | 3 | the next byte on the serial line | the frame fails its CRC and is dropped and counted |
//! | supervise | 2 | the watchdog's time | the watchdog resets the board |
//! | transmit | 1 | none | commands that find the queue full are counted |
#![no_std]
#![no_main]

mod board;

use board::{Board, Chosen};
use core::panic::PanicInfo;

/// Shorthand for the parts of the board that this image is for.
mod part {
    use super::{Board, Chosen};
    pub type Axis = <Chosen as Board>::Axis;
    pub type Stopwatch = <Chosen as Board>::Stopwatch;
    pub type SerialIn = <Chosen as Board>::SerialIn;
    pub type SerialOut = <Chosen as Board>::SerialOut;
    pub type Watchdog = <Chosen as Board>::Watchdog;
    pub type Storage = <Chosen as Board>::Storage;
}

#[rtic::app(device = crate::board::device, peripherals = false)]
mod app {
    use super::part;
    use crate::board::{
        Axis, Board, Chosen, Parts, SerialIn, SerialOut, Stopwatch, Watchdog, device, keep,
        take_kept,
    };
    use firmware::codes::AdcCodes;
    use firmware::control_task::{Command, ControlTask, Sample};
    use firmware::cost::{Cost, Report};
    use firmware::frame::{self, Decoder, Received};
    use firmware::link::{self, FromPlant, Order};
    use firmware::settings::slots::Slots;
    use firmware::start::{ResetCause, cause_of, finding_of};
    use firmware::status::FaultMemory;
    use heapless::spsc::{Consumer, Producer, Queue};
    use model_core::controller::Controller;
    use model_core::reference::Reference;
    use rtic::Mutex;

    #[expect(clippy::cast_possible_truncation, reason = "the nearest f32 is meant")]
    const TICK_PERIOD_S: f32 = (Chosen::TICK_PERIOD_NS as f64 * 1e-9) as f32;
    /// Commands on their way to the serial line.
    const QUEUE_LENGTH: usize = 8;
    /// Runs of the supervisor from one status report to the next: some a second.
    const SUPERVISIONS_PER_STATUS: u8 = 20;
    /// Orders between two samples; the queue holds one less.
    const ORDERS_LENGTH: usize = 4;

    #[shared]
    struct Shared {
        /// The control task, also for those who ask how it is.
        control_task: ControlTask,
        /// The latest sample that came over the serial line.
        streamed: Sample,
        /// What the application tells of itself.
        report: Report,
        /// The plant has ended the run.
        has_ended: bool,
        /// A status report is due.
        status_is_due: bool,
    }

    #[local]
    struct Local {
        axis: part::Axis,
        stopwatch: part::Stopwatch,
        /// Code of the fault that is kept over a reset.
        kept_fault: u8,
        orders: Consumer<'static, Order>,
        commands: Producer<'static, Command>,
        serial_in: part::SerialIn,
        decoder: Decoder,
        ordered: Producer<'static, Order>,
        watchdog: part::Watchdog,
        supervision: Supervision,
        reset_cause: ResetCause,
        serial_out: part::SerialOut,
        outgoing: Consumer<'static, Command>,
    }

    /// What the supervisor remembers.
    pub struct Supervision {
        /// Ticks that the control task had run.
        ticks: u32,
        /// Runs of the supervisor since the last status report.
        since_status: u8,
    }

    #[init(local = [
        queue: Queue<Command, QUEUE_LENGTH> = Queue::new(),
        order_queue: Queue<Order, ORDERS_LENGTH> = Queue::new(),
    ])]
    fn init(context: init::Context) -> (Shared, Local) {
        let kept_cause = take_kept().unwrap_or(0);
        let Parts {
            axis,
            stopwatch,
            serial_in,
            mut serial_out,
            watchdog,
            storage,
            reset_cause,
            finding,
        } = Chosen::start(context.core);
        let mut control_task = ControlTask::new(controller(storage));
        let found = [finding, finding_of(kept_cause), reset_cause.finding()];
        for finding in found.into_iter().flatten() {
            control_task.recall(&FaultMemory {
                finding: Some(finding),
                tick: 0,
            });
        }
        let (commands, outgoing) = context.local.queue.split();
        let (ordered, orders) = context.local.order_queue.split();
        send(&mut serial_out, &link::hello(Chosen::TICK_PERIOD_NS));
        let shared = Shared {
            control_task,
            streamed: nothing_streamed(),
            report: Report {
                cost: Cost::default(),
                counts_per_s: part::Stopwatch::COUNTS_PER_S,
                stack_bytes: 0,
                dropped_frames: 0,
                lost_commands: 0,
                reset_cause: reset_cause as u8,
                kept_cause,
            },
            has_ended: false,
            status_is_due: false,
        };
        let local = Local {
            axis,
            stopwatch,
            kept_fault: 0,
            orders,
            commands,
            serial_in,
            decoder: Decoder::new(),
            ordered,
            watchdog,
            supervision: Supervision {
                ticks: 0,
                since_status: 0,
            },
            reset_cause,
            serial_out,
            outgoing,
        };
        (shared, local)
    }

    /// The controller of the settings in the slots, or the built-in one. The slot
    /// that the next settings go to is erased now, while nothing has to be in time.
    fn controller(storage: part::Storage) -> Controller<f32> {
        let Ok((mut slots, start)) = Slots::start(storage, TICK_PERIOD_S) else {
            // Not with a board's own period, which the settings were tried with.
            Chosen::give_up();
        };
        // Where it cannot be erased, storing says so.
        let _erased = slots.prepare();
        start.controller
    }

    #[idle]
    fn idle(_: idle::Context) -> ! {
        loop {
            cortex_m::asm::wfi();
        }
    }

    #[task(binds = DMA2_STREAM0, priority = 4, shared = [streamed, report, control_task],
           local = [axis, stopwatch, kept_fault, orders, commands])]
    fn control(context: control::Context) {
        let (mut local, mut shared) = (context.local, context.shared);
        local.stopwatch.start();
        let sample = shared.streamed.lock(|streamed| local.axis.sample(streamed));
        let finding = local.axis.finding();
        let command = shared.control_task.lock(|control_task| {
            if let Some(finding) = finding {
                control_task.note_fault(finding);
            }
            // At most as many as the queue holds: who fills it waits for this task.
            while let Some(order) = local.orders.dequeue() {
                control_task.obey(order);
            }
            let command = control_task.tick(&sample);
            if command.fault != *local.kept_fault {
                *local.kept_fault = command.fault;
                keep(cause_of(control_task.fault_memory().finding));
            }
            command
        });
        local.axis.write_valve(command.valve);
        shared
            .report
            .lock(|report| hand_on(&mut local, command, report));
    }

    /// Gives the command to the serial line, and stops the watch.
    fn hand_on(local: &mut control::LocalResources<'_>, command: Command, report: &mut Report) {
        if local.commands.enqueue(command).is_err() {
            report.lost_commands = report.lost_commands.saturating_add(1);
        }
        rtic::pend(device::Interrupt::UART5);
        report.cost.add(local.stopwatch.stop());
    }

    #[task(binds = USART1, priority = 3, shared = [streamed, report, has_ended],
           local = [serial_in, decoder, ordered])]
    fn receive(mut context: receive::Context) {
        let (decoder, ordered) = (context.local.decoder, context.local.ordered);
        let Some(byte) = context.local.serial_in.byte() else {
            return;
        };
        match decoder.feed(byte) {
            Received::Nothing => {}
            Received::Payload(payload) => take(payload, ordered, &mut context.shared),
            Received::Dropped => context.shared.report.lock(count_dropped),
        }
    }

    fn take(
        payload: &[u8],
        ordered: &mut Producer<'static, Order>,
        shared: &mut receive::SharedResources<'_>,
    ) {
        match link::from_plant(payload) {
            Some(FromPlant::Sample(sample)) => {
                shared.streamed.lock(|streamed| *streamed = sample);
                Chosen::sample_streamed();
            }
            Some(FromPlant::End) => {
                shared.has_ended.lock(|has_ended| *has_ended = true);
                rtic::pend(device::Interrupt::UART5);
            }
            Some(FromPlant::Order(order)) => {
                // A fault that did not happen is for simulations only.
                let is_for_us = Chosen::ANSWERS_PLANT || order == Order::Acknowledge;
                if !is_for_us || ordered.enqueue(order).is_err() {
                    shared.report.lock(count_dropped);
                }
            }
            None => shared.report.lock(count_dropped),
        }
    }

    fn count_dropped(report: &mut Report) {
        report.dropped_frames = report.dropped_frames.saturating_add(1);
    }

    #[task(binds = TIM7, priority = 2, shared = [report, status_is_due],
           local = [watchdog, supervision])]
    fn supervise(mut context: supervise::Context) {
        let supervision = context.local.supervision;
        let ticks = context.shared.report.lock(|report| report.cost.ticks);
        if ticks != supervision.ticks {
            context.local.watchdog.feed();
        }
        supervision.ticks = ticks;
        supervision.since_status = (supervision.since_status + 1) % SUPERVISIONS_PER_STATUS;
        if supervision.since_status == 0 && !Chosen::ANSWERS_PLANT {
            context.shared.status_is_due.lock(|is_due| *is_due = true);
            rtic::pend(device::Interrupt::UART5);
        }
    }

    #[task(binds = UART5, priority = 1, shared = [report, control_task, has_ended, status_is_due],
           local = [serial_out, outgoing, reset_cause])]
    fn transmit(mut context: transmit::Context) {
        while let Some(command) = context.local.outgoing.dequeue() {
            if Chosen::ANSWERS_PLANT {
                send(context.local.serial_out, &link::command(&command));
            }
        }
        if context.shared.status_is_due.lock(core::mem::take) {
            let reset_cause = *context.local.reset_cause;
            let control_task = &mut context.shared.control_task;
            let status = control_task.lock(|control_task| control_task.status(reset_cause));
            send(context.local.serial_out, &status.payload());
        }
        if context.shared.has_ended.lock(core::mem::take) {
            let mut report = context.shared.report.lock(|report| *report);
            report.stack_bytes = Chosen::stack_bytes();
            send(context.local.serial_out, &report.payload());
            Chosen::run_ended();
        }
    }

    fn send(serial_out: &mut part::SerialOut, payload: &[u8]) {
        if let Some(frame) = frame::encode(payload) {
            serial_out.send(&frame);
        }
    }

    fn nothing_streamed() -> Sample {
        Sample {
            tick: 0,
            codes: AdcCodes::from_array([0; 5]),
            reference: Reference {
                position_m: f32::NAN,
                velocity_m_per_s: f32::NAN,
                acceleration_m_per_s2: f32::NAN,
            },
        }
    }
}

/// A defect outside the control path, which holds no panic.
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    panicked()
}

/// The cause is kept over the reset; nothing waits for a debugger. A function of
/// its own: `cargo xtask size` looks in the image for what reaches it.
#[inline(never)]
fn panicked() -> ! {
    cortex_m::interrupt::disable();
    board::keep(firmware::start::PANIC);
    Chosen::give_up()
}
