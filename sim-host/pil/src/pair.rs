//! Sends the same requests to a microcontroller and to this process, and compares the answers byte
//! by byte.

use sonarfix::geometry::units::Instant;
use sonarfix::localizer::Localizer;
use sonarfix_pil::Unmetered;
use sonarfix_pil::line::{self, ANSWER_MAX};
use sonarfix_pil::{Actuators, Answer, Begin, Request, RequestError, Session, Wires};

use super::difference::difference;
use super::error::PilError;
use super::exchange::Exchange;
use super::machine::Emulator;
use super::progress::Progress;
use super::tally::Tally;

/// A microcontroller, if there is one, and this process.
#[derive(Debug)]
pub struct Pair {
    emulator: Option<Emulator>,
    is_in_session: bool,
    requests: u64,
    progress: Progress,
    /// Instruction counts.
    pub tally: Tally,
    /// All requests and answers, if they are recorded.
    pub recorded: Option<Vec<Exchange>>,
}

impl Pair {
    /// A pair; without an emulator this process answers alone.
    #[must_use]
    pub fn new(emulator: Option<Emulator>, progress: Progress) -> Self {
        Self {
            emulator,
            is_in_session: false,
            requests: 0,
            progress,
            tally: Tally::default(),
            recorded: None,
        }
    }

    /// Number of requests.
    #[must_use]
    pub fn requests(&self) -> u64 {
        self.requests
    }

    /// Begins a session of a localizer alone.
    ///
    /// # Errors
    /// [`PilError`].
    pub fn begin_localizer<'m>(
        &mut self,
        begin: &Begin,
        map: &'m [u8],
    ) -> Result<Session<'m>, PilError> {
        let begun = Session::localizer_only(begin, map);
        self.begun(begin, map, begun.map(|session| (session, Actuators::default())))
            .map(|(session, _)| session)
    }

    /// Begins a session of the loop; returns its first outputs, too.
    ///
    /// # Errors
    /// [`PilError`].
    pub fn begin_loop<'m>(
        &mut self,
        begin: &Begin,
        map: &'m [u8],
        wires: &'m Wires,
    ) -> Result<(Session<'m>, Actuators), PilError> {
        let own = Session::begin(begin, map, wires, &mut Unmetered);
        self.begun(begin, map, own.map(|(session, actuators, _)| (session, actuators)))
    }

    fn begun<'m>(
        &mut self,
        begin: &Begin,
        map: &[u8],
        own: Result<(Session<'m>, Actuators), RequestError>,
    ) -> Result<(Session<'m>, Actuators), PilError> {
        self.end()?;
        // The configuration is some hundred bytes.
        let mut space = vec![0; map.len() + 1_024];
        let request = line::encode(&Request::Begin(*begin, map), &mut space);
        let request = request.ok_or(PilError::TooLong)?;
        let answer = match &own {
            Ok((_, actuators)) => Answer::Started(*actuators),
            Err(refusal) => Answer::Refused(*refusal),
        };
        if let Some(emulator) = &mut self.emulator {
            emulator.send_request(request)?;
        }
        let instructions = self.compare(begin.at.ticks(), request, &answer)?;
        self.tally.begun(instructions);
        self.is_in_session = own.is_ok();
        own.map_err(PilError::Refused)
    }

    /// Sends a request to both; returns the answer.
    ///
    /// # Errors
    /// [`PilError::Differs`] if the answers differ; another error if the emulator fails.
    pub fn execute(
        &mut self,
        session: &mut Session,
        request: &Request,
    ) -> Result<Answer, PilError> {
        let mut space = [0; line::REQUEST_MAX];
        let bytes = line::encode(request, &mut space).ok_or(PilError::TooLong)?;
        // The emulator computes while this process does.
        if let Some(emulator) = &mut self.emulator {
            emulator.send_request(bytes)?;
        }
        let (own, _) = session.execute(request, &mut Unmetered);
        let at = match request {
            Request::Poll(sensors) => sensors.at,
            Request::Odometry(at, ..) => *at,
            _ => session.localizer().map_or(Instant::from_ticks(0), Localizer::time),
        };
        let instructions = self.compare(at.ticks(), bytes, &own)?;
        self.tally.add(request, &own, instructions);
        self.requests += 1;
        self.progress.reach(at);
        Ok(own)
    }

    /// Compares the emulator's answer with this process's; returns the number of instructions.
    fn compare(&mut self, micros: u64, request: &[u8], own: &Answer) -> Result<u32, PilError> {
        let mut space = [0; ANSWER_MAX];
        let bytes = line::encode(own, &mut space).ok_or(PilError::TooLong)?;
        if let Some(recorded) = &mut self.recorded {
            recorded.push(Exchange { request: request.to_vec(), answer: bytes.to_vec() });
        }
        let Some(emulator) = &mut self.emulator else { return Ok(0) };
        let mut space = [0; ANSWER_MAX];
        let (theirs, instructions) = emulator.receive_reply(&mut space)?;
        if theirs == bytes {
            return Ok(instructions);
        }
        let what = difference(own, line::decode_answer(theirs).as_ref());
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
        emulator.send_request(line::encode(&Request::End, &mut space).ok_or(PilError::TooLong)?)?;
        let mut space = [0; ANSWER_MAX];
        let (answer, _) = emulator.receive_reply(&mut space)?;
        match line::decode_answer(answer) {
            Some(Answer::Ended(stack)) => self.tally.stack = self.tally.stack.max(stack),
            Some(other) => return Err(PilError::Mismatched(Box::new(other))),
            None => return Err(PilError::Emulator("the answer cannot be decoded".to_owned())),
        }
        Ok(())
    }
}
