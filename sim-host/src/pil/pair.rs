//! Asks a microcontroller and this process the same, and compares what they answer, byte by byte.

use sonarfix::localizer::Localizer;
use sonarfix::units::Instant;
use sonarfix_map::BakeError;
use sonarfix_pil::line::{self, ANSWER_MAX};
use sonarfix_pil::serve::Unmetered;
use sonarfix_pil::{Actuators, Answer, Begin, Device, Refusal, Request, Wires};

use super::difference::difference;
use super::golden::Exchange;
use super::machine::Emulator;
use super::progress::Progress;
use super::tally::Tally;

/// What keeps a microcontroller from the loop.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PilError {
    /// The map.
    #[error("the map cannot be baked: {0}")]
    Map(BakeError),
    /// The emulator.
    #[error("{0}")]
    Emulator(String),
    /// The request is longer than it may be.
    #[error("the map is too large for the emulated microcontroller")]
    TooLong,
    /// The session did not begin.
    #[error("{0}")]
    Refused(Refusal),
    /// The loop does not run.
    #[error("the robot's loop does not run")]
    Stopped,
    /// Something else was answered than was asked.
    #[error("the answer does not belong to the question: {0:?}")]
    Unasked(Box<Answer>),
    /// They are not the same.
    #[error("at {seconds:.3} s the microcontroller and the PC do not agree: {what}")]
    Differs {
        /// Simulated seconds.
        seconds: f64,
        /// In what.
        what: String,
    },
}

/// A microcontroller, if there is one, and this process.
#[derive(Debug)]
pub struct Pair {
    emulator: Option<Emulator>,
    is_in_session: bool,
    questions: u64,
    progress: Progress,
    /// What the emulator counted.
    pub tally: Tally,
    /// All that was asked and answered, if it is to be kept.
    pub recorded: Option<Vec<Exchange>>,
}

impl Pair {
    /// A pair; without an emulator this process is alone.
    #[must_use]
    pub fn new(emulator: Option<Emulator>, progress: Progress) -> Self {
        Self {
            emulator,
            is_in_session: false,
            questions: 0,
            progress,
            tally: Tally::default(),
            recorded: None,
        }
    }

    /// How many questions were asked and answered.
    #[must_use]
    pub fn questions(&self) -> u64 {
        self.questions
    }

    /// Begins a session of a localizer alone.
    ///
    /// # Errors
    /// [`PilError`].
    pub fn begin_localizer<'m>(
        &mut self,
        begin: &Begin,
        map: &'m [u8],
    ) -> Result<Device<'m>, PilError> {
        let begun = Device::localizer_only(begin, map);
        self.begun(begin, map, begun.map(|device| (device, Actuators::default())))
            .map(|(device, _)| device)
    }

    /// Begins a session of the loop; with what it did to its devices at once.
    ///
    /// # Errors
    /// [`PilError`].
    pub fn begin_loop<'m>(
        &mut self,
        begin: &Begin,
        map: &'m [u8],
        wires: &'m Wires,
    ) -> Result<(Device<'m>, Actuators), PilError> {
        self.begun(begin, map, Device::begin(begin, map, wires))
    }

    fn begun<'m>(
        &mut self,
        begin: &Begin,
        map: &[u8],
        own: Result<(Device<'m>, Actuators), Refusal>,
    ) -> Result<(Device<'m>, Actuators), PilError> {
        self.end()?;
        // The configuration is some hundred bytes.
        let mut space = vec![0; map.len() + 1_024];
        let request = line::bytes(&Request::Begin(*begin, map), &mut space);
        let request = request.ok_or(PilError::TooLong)?;
        let answer = match &own {
            Ok((_, actuators)) => Answer::Began(*actuators),
            Err(refusal) => Answer::Refused(*refusal),
        };
        if let Some(emulator) = &mut self.emulator {
            emulator.ask(request)?;
        }
        self.compare(begin.at.ticks(), request, &answer)?;
        self.is_in_session = own.is_ok();
        own.map_err(PilError::Refused)
    }

    /// Asks both; gives what they answered.
    ///
    /// # Errors
    /// [`PilError::Differs`] with where, if they do not answer the same; another if one is gone.
    pub fn ask(&mut self, device: &mut Device, request: &Request) -> Result<Answer, PilError> {
        let mut space = [0; line::REQUEST_MAX];
        let bytes = line::bytes(request, &mut space).ok_or(PilError::TooLong)?;
        // The emulator computes while this process does.
        if let Some(emulator) = &mut self.emulator {
            emulator.ask(bytes)?;
        }
        let (own, _) = device.answer(request, &mut Unmetered);
        let at = match request {
            Request::Poll(sensors) => sensors.at,
            Request::Odometry(at, _) => *at,
            _ => device.localizer().map_or(Instant::from_ticks(0), Localizer::time),
        };
        let instructions = self.compare(at.ticks(), bytes, &own)?;
        self.tally.add(request, &own, instructions);
        self.questions += 1;
        self.progress.reach(at);
        Ok(own)
    }

    /// Takes the emulator's answer and compares it with this process's; gives the instructions.
    fn compare(&mut self, micros: u64, request: &[u8], own: &Answer) -> Result<u32, PilError> {
        let mut space = [0; ANSWER_MAX];
        let bytes = line::bytes(own, &mut space).ok_or(PilError::TooLong)?;
        if let Some(recorded) = &mut self.recorded {
            recorded.push(Exchange { request: request.to_vec(), answer: bytes.to_vec() });
        }
        let Some(emulator) = &mut self.emulator else { return Ok(0) };
        let mut space = [0; ANSWER_MAX];
        let (theirs, instructions) = emulator.replied(&mut space)?;
        if theirs == bytes {
            return Ok(instructions);
        }
        let what = difference(own, line::answer(theirs).as_ref());
        #[expect(clippy::cast_precision_loss, reason = "hours, in microseconds")]
        Err(PilError::Differs { seconds: micros as f64 * 1e-6, what })
    }

    /// Ends the session, if there is one.
    ///
    /// # Errors
    /// [`PilError::Emulator`].
    pub fn end(&mut self) -> Result<(), PilError> {
        if !std::mem::take(&mut self.is_in_session) {
            return Ok(());
        }
        let Some(emulator) = &mut self.emulator else { return Ok(()) };
        let mut space = [0; line::REQUEST_MAX];
        emulator.ask(line::bytes(&Request::End, &mut space).ok_or(PilError::TooLong)?)?;
        let mut space = [0; ANSWER_MAX];
        let (answer, _) = emulator.replied(&mut space)?;
        match line::answer(answer) {
            Some(Answer::Ended(stack)) => self.tally.stack = self.tally.stack.max(stack),
            Some(other) => return Err(PilError::Unasked(Box::new(other))),
            None => return Err(PilError::Emulator("what came is no answer".to_owned())),
        }
        Ok(())
    }
}
