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
use firmware::crash::Crash;

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
        kept_crash, take_kept,
    };
    use core::mem::MaybeUninit;
    use firmware::codes::{AdcCodes, DacCode};
    use firmware::control_task::ControlTask;
    use firmware::cost::{Cost, Report};
    use firmware::crash::{self, Crash};
    use firmware::experiment::frames as experiment;
    use firmware::fault::Fault;
    use firmware::frame::{self, Decoder, Received};
    use firmware::link::{self, FromPlant, Order, Payload};
    use firmware::settings::Connection;
    use firmware::settings::slots::{Origin, Slots};
    use firmware::settings::transfer::Transfer;
    use firmware::start::{ResetCause, cause_of, finding_of};
    use firmware::status::Program;
    use firmware::telemetry::{self, Streaming, Tap};
    use firmware::tick::{Command, Sample, State};
    use heapless::spsc::{Consumer, Producer, Queue};
    use model_core::reference::Reference;
    use rtic::Mutex;

    #[expect(clippy::cast_possible_truncation, reason = "the nearest f32 is meant")]
    const TICK_PERIOD_S: f32 = (Chosen::TICK_PERIOD_NS as f64 * 1e-9) as f32;
    /// Commands on their way to the serial line.
    const QUEUE_LENGTH: usize = 8;
    /// Runs of the supervisor from one status report to the next: some a second.
    const SUPERVISIONS_PER_STATUS: u8 = 20;
    /// Which program this is; `cargo xtask image` says of which commit.
    const PROGRAM: Program = Program::of(
        [
            env!("CARGO_PKG_VERSION_MAJOR"),
            env!("CARGO_PKG_VERSION_MINOR"),
            env!("CARGO_PKG_VERSION_PATCH"),
        ],
        option_env!("PNEUMA_COMMIT"),
    );
    /// Nothing is asked for.
    const NO_REFERENCE: Reference<f32> = Reference {
        position_m: f32::NAN,
        velocity_m_per_s: f32::NAN,
        acceleration_m_per_s2: f32::NAN,
    };

    #[shared]
    struct Shared {
        /// The control task, also for those who ask how it is or tell it something.
        control_task: &'static mut ControlTask,
        /// The latest sample or reference that came over the serial line.
        streamed: Sample,
        /// Takes ticks for telemetry.
        tap: &'static mut Tap,
        /// What the application tells of itself.
        report: Report,
        /// A frame that has time: about settings or telemetry.
        request: Option<Payload>,
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
        commands: Producer<'static, Command>,
        serial_in: part::SerialIn,
        watchdog: part::Watchdog,
        supervision: Supervision,
        serial_out: part::SerialOut,
        outgoing: Consumer<'static, Command>,
        slots: Slots<part::Storage>,
        started: Started,
    }

    /// What the supervisor remembers.
    pub struct Supervision {
        /// Ticks that the control task had run.
        ticks: u32,
        /// Runs of the supervisor since the last status report.
        since_status: u8,
    }

    /// How the board started.
    pub struct Started {
        reset_cause: ResetCause,
        has_built_in_settings: bool,
        /// Where the program crashed last.
        crash: Option<Crash>,
    }

    // What is large lies where it stays from the beginning: this function's stack
    // is never given back.
    #[init(local = [
        control_task: MaybeUninit<ControlTask> = MaybeUninit::uninit(),
        tap: Tap = Tap::new(DacCode(0x8000)),
        queue: Queue<Command, QUEUE_LENGTH> = Queue::new(),
    ])]
    fn init(context: init::Context) -> (Shared, Local) {
        let kept_cause = take_kept().unwrap_or(0);
        let Parts {
            mut axis,
            stopwatch,
            serial_in,
            mut serial_out,
            watchdog,
            storage,
            reset_cause,
            finding,
        } = Chosen::start(context.core);
        let (slots, control_task, origin) = settings(storage, context.local.control_task);
        let has_built_in_settings = !origin.is_of_this_rig();
        // The last one counts: what nobody can acknowledge, and the clocks' first.
        let found = [
            finding_of(kept_cause),
            reset_cause.finding(),
            origin.finding(),
            finding,
        ];
        for finding in found.into_iter().flatten() {
            control_task.recall(finding);
        }
        let (commands, outgoing) = context.local.queue.split();
        send(&mut serial_out, &link::hello(Chosen::TICK_PERIOD_NS));
        axis.begin();
        let shared = Shared {
            control_task,
            streamed: nothing_streamed(),
            tap: context.local.tap,
            report: Report {
                cost: Cost::default(),
                counts_per_s: stopwatch.counts_per_s(),
                stack_bytes: 0,
                dropped_frames: 0,
                lost_commands: 0,
                reset_cause: reset_cause as u8,
                kept_cause,
            },
            request: None,
            has_ended: false,
            status_is_due: false,
        };
        let local = Local {
            axis,
            stopwatch,
            kept_fault: 0,
            commands,
            serial_in,
            watchdog,
            supervision: Supervision {
                ticks: 0,
                since_status: 0,
            },
            serial_out,
            outgoing,
            slots,
            started: Started {
                reset_cause,
                has_built_in_settings,
                crash: kept_crash(),
            },
        };
        (shared, local)
    }

    /// The control task by the settings in the slots, or the built-in ones. The
    /// slot that the next settings go to is erased now, while nothing has to be in
    /// time. A function of its own: what it holds on the stack is gone afterwards.
    #[inline(never)]
    fn settings(
        storage: part::Storage,
        place: &'static mut MaybeUninit<ControlTask>,
    ) -> (Slots<part::Storage>, &'static mut ControlTask, Origin) {
        let (mut slots, mut start) = Slots::start(storage);
        let Ok(controller) = start.build(TICK_PERIOD_S) else {
            // Not with a board's own period, which the settings were tried with.
            Chosen::give_up();
        };
        // Where it cannot be erased, storing says so.
        let _erased = slots.prepare();
        let control_task = place.write(ControlTask::of(
            controller,
            &connected(&start.connection()),
            Chosen::VALVE_CONVERTER,
        ));
        (slots, control_task, start.origin)
    }

    /// A plant gives codes on the scales of the link, whatever its sensors are.
    fn connected(connection: &Connection) -> Connection {
        if Chosen::ANSWERS_PLANT {
            Connection::standard(connection.wiring)
        } else {
            *connection
        }
    }

    #[idle]
    fn idle(_: idle::Context) -> ! {
        loop {
            cortex_m::asm::wfi();
        }
    }

    #[task(binds = DMA2_STREAM0, priority = 4, shared = [control_task, streamed, tap, report],
           local = [axis, stopwatch, kept_fault, commands])]
    fn control(context: control::Context) {
        let (mut local, mut shared) = (context.local, context.shared);
        local.stopwatch.start();
        let sample = shared.streamed.lock(|streamed| local.axis.sample(streamed));
        let finding = local.axis.finding();
        let command = shared.control_task.lock(|control_task| {
            if let Some(finding) = finding {
                control_task.note_fault(finding);
            }
            control_task.tick(&sample)
        });
        local.axis.write_valve(command.valve);
        let fault = Fault::from_code(command.fault);
        local
            .axis
            .switch_valve(!fault.is_some_and(Fault::is_of_output));
        hand_on(&mut local, &mut shared, &sample, command);
    }

    /// Tells the other tasks, and stops the watch.
    fn hand_on(
        local: &mut control::LocalResources<'_>,
        shared: &mut control::SharedResources<'_>,
        sample: &Sample,
        command: Command,
    ) {
        if command.state == State::Fault {
            // Nothing moves after the acknowledgement until somebody asks anew.
            shared.streamed.lock(|it| it.reference = NO_REFERENCE);
        }
        if command.fault != *local.kept_fault {
            *local.kept_fault = command.fault;
            let latched = shared
                .control_task
                .lock(|control_task| control_task.latched());
            keep(cause_of(latched));
        }
        shared.tap.lock(|tap| tap.offer(sample, &command));
        let is_lost = Chosen::ANSWERS_PLANT && local.commands.enqueue(command).is_err();
        rtic::pend(device::Interrupt::UART5);
        shared.report.lock(|report| {
            report.lost_commands = report.lost_commands.saturating_add(u32::from(is_lost));
            report.cost.add(local.stopwatch.stop());
        });
    }

    #[task(binds = USART1, priority = 3, shared = [control_task, streamed, request, has_ended, status_is_due],
           local = [serial_in, decoder: Decoder = Decoder::new()])]
    fn receive(mut context: receive::Context) {
        let decoder = context.local.decoder;
        let Some(byte) = context.local.serial_in.byte() else {
            return;
        };
        let is_dropped = match decoder.feed(byte) {
            Received::Nothing => false,
            Received::Payload(payload) => !take(payload, &mut context.shared),
            Received::Dropped => true,
        };
        if is_dropped {
            context.shared.control_task.lock(|it| count_dropped(it));
        }
    }

    /// Does what a frame asks for; whether anybody here wants it.
    fn take(payload: &[u8], shared: &mut receive::SharedResources<'_>) -> bool {
        match link::from_plant(payload) {
            Some(FromPlant::Sample(sample)) if Chosen::ANSWERS_PLANT => {
                shared.streamed.lock(|streamed| *streamed = sample);
                Chosen::sample_streamed();
            }
            Some(FromPlant::End) if Chosen::ANSWERS_PLANT => {
                shared.has_ended.lock(|has_ended| *has_ended = true);
                rtic::pend(device::Interrupt::UART5);
            }
            Some(FromPlant::Reference(reference)) if !Chosen::ANSWERS_PLANT => {
                shared.control_task.lock(|it| it.let_go());
                shared.streamed.lock(|it| it.reference = reference);
            }
            // A fault that did not happen is for simulations only.
            Some(FromPlant::Order(order))
                if Chosen::ANSWERS_PLANT || order == Order::Acknowledge =>
            {
                shared.control_task.lock(|it| it.obey(order));
            }
            Some(FromPlant::AskStatus) => {
                shared.status_is_due.lock(|is_due| *is_due = true);
                rtic::pend(device::Interrupt::UART5);
            }
            None => return put_by(payload, shared),
            Some(_) => return false,
        }
        true
    }

    /// Leaves a frame to the task that has time; its sender waits for the answer
    /// to the one before.
    fn put_by(payload: &[u8], shared: &mut receive::SharedResources<'_>) -> bool {
        let request = Payload::from_slice(payload).ok();
        let is_taken = shared.request.lock(|waiting| {
            let is_free = waiting.is_none();
            if is_free {
                *waiting = request;
            }
            is_free
        });
        rtic::pend(device::Interrupt::UART5);
        is_taken
    }

    fn count_dropped(control_task: &mut ControlTask) {
        let dropped = &mut control_task.counters_mut().dropped_frames;
        *dropped = dropped.saturating_add(1);
    }

    #[task(binds = TIM7, priority = 2, shared = [control_task, report, status_is_due],
           local = [watchdog, supervision])]
    fn supervise(mut context: supervise::Context) {
        let supervision = context.local.supervision;
        let ticks = context.shared.report.lock(|report| report.cost.ticks);
        if ticks != supervision.ticks {
            context.local.watchdog.feed();
        } else if ticks > 0 && !Chosen::ANSWERS_PLANT {
            restart_ticks(&mut context.shared);
        }
        supervision.ticks = ticks;
        supervision.since_status = (supervision.since_status + 1) % SUPERVISIONS_PER_STATUS;
        if supervision.since_status == 0 && !Chosen::ANSWERS_PLANT {
            context.shared.status_is_due.lock(|is_due| *is_due = true);
            rtic::pend(device::Interrupt::UART5);
        }
    }

    /// No tick since the supervisor ran last, and the valve holds its last command: it is taken
    /// to its middle, and the control task is called to arm the converters anew.
    fn restart_ticks(shared: &mut supervise::SharedResources<'_>) {
        Chosen::isolate_valve();
        let finding = Fault::TaskOverrun.at(1);
        shared.control_task.lock(|it| it.note_fault(finding));
        rtic::pend(device::Interrupt::DMA2_STREAM0);
    }

    #[task(binds = UART5, priority = 1,
           shared = [control_task, tap, report, request, has_ended, status_is_due],
           local = [serial_out, outgoing, slots, started,
                    transfer: Transfer = Transfer::new(TICK_PERIOD_S)])]
    fn transmit(context: transmit::Context) {
        let (mut local, mut shared) = (context.local, context.shared);
        // Asked first: whatever came before the end is answered and counted below.
        let has_ended = shared.has_ended.lock(core::mem::take);
        send_commands(&mut local);
        while let Some(record) = shared.tap.lock(|tap| tap.take()) {
            // A tick may have come meanwhile: its command goes before its record.
            send_commands(&mut local);
            send(local.serial_out, &telemetry::tick(&record));
        }
        if let Some(request) = shared.request.lock(Option::take) {
            match answer(&request, &mut local, &mut shared) {
                Some(answer) => send(local.serial_out, &answer),
                None => shared.control_task.lock(|it| count_dropped(it)),
            }
        }
        if shared.control_task.lock(|it| it.take_void()) {
            // Where it cannot be stored, it is unchecked until the next start.
            let _stored = local.slots.void_wiring();
        }
        if shared.status_is_due.lock(core::mem::take) {
            let started = &local.started;
            let mut status = shared
                .control_task
                .lock(|it| it.status(started.reset_cause, started.has_built_in_settings));
            status.program = PROGRAM;
            status.tick_cost = shared.report.lock(|report| *report).tick_cost();
            send(local.serial_out, &status.payload());
        }
        if has_ended {
            end_run(local.serial_out, &mut shared);
        }
    }

    fn send_commands(local: &mut transmit::LocalResources<'_>) {
        while let Some(command) = local.outgoing.dequeue() {
            send(local.serial_out, &link::command(&command));
        }
    }

    /// The answer to a frame about settings, telemetry, an experiment or a crash; `None` to any other.
    fn answer(
        request: &[u8],
        local: &mut transmit::LocalResources<'_>,
        shared: &mut transmit::SharedResources<'_>,
    ) -> Option<Payload> {
        if let Some(wish) = telemetry::read_stream(request) {
            let period_ns = Chosen::TICK_PERIOD_NS;
            let decimation = telemetry::granted_decimation(wish, period_ns, Chosen::BAUD);
            shared.tap.lock(|tap| tap.set_decimation(decimation));
            return Some(telemetry::streaming(Streaming {
                decimation,
                tick_period_ns: Chosen::TICK_PERIOD_NS,
            }));
        }
        if let Some(wish) = experiment::read_request(request) {
            let report = shared.control_task.lock(|it| it.serve_experiment(&wish));
            return Some(report.payload());
        }
        if crash::is_asked(request) {
            return Some(crash::told(local.started.crash.as_ref()));
        }
        let has_built_in_settings = &mut local.started.has_built_in_settings;
        local
            .transfer
            .serve(request, local.slots, |controller, connection| {
                shared
                    .control_task
                    .lock(|it| it.replace_controller(controller, &connected(connection)))?;
                *has_built_in_settings = false;
                Ok(())
            })
    }

    fn end_run(serial_out: &mut part::SerialOut, shared: &mut transmit::SharedResources<'_>) {
        let mut report = shared.report.lock(|report| *report);
        report.dropped_frames = shared
            .control_task
            .lock(|it| it.counters_mut().dropped_frames);
        report.stack_bytes = Chosen::stack_bytes();
        send(serial_out, &report.payload());
        Chosen::run_ended();
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
            reference: NO_REFERENCE,
        }
    }
}

/// A defect outside the control path, which holds no panic.
#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    let place = info.location();
    board::keep_crash(place.map_or_else(Crash::default, |place| {
        Crash::at(place.file(), place.line())
    }));
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
