//! The program: DDS, the clock and the robot's port around the managed node.

use std::rc::Rc;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use anyhow::Context;
use async_channel::{Receiver, Sender};
use smol::{LocalExecutor, Task, Timer};
use sonarfix_link::Command;
use sonarfix_ros_messages::messages::{
    Clock, DiagnosticArray, Imu, JointState, LaserScan, MarkerArray, OccupancyGrid, Odometry,
    ParticleCloud, PoseWithCovarianceStamped, Range, RangeHeard, Status, TFMessage, Twist,
};

use crate::arguments::Arguments;
use crate::graph::{Graph, Publishers, Quality, mapping};
use crate::interfaces::{
    ChangeStateRequest, ChangeStateResponse, DescribeParametersResponse, Empty,
    GetAvailableStatesResponse, GetAvailableTransitionsResponse, GetParameterTypesResponse,
    GetParametersResponse, GetStateResponse, ListParametersRequest, ListParametersResponse,
    ParameterEvent, ParameterNames, SetInitialPoseRequest, SetParametersAtomicallyResponse,
    SetParametersRequest, SetParametersResponse, TransitionEvent, TriggerResponse,
};
use crate::lifecycle::{State, Transition};
use crate::managed::{self, Effect, Managed};
use crate::names::Names;
use crate::node::Input;
use crate::port;
use crate::problem::Nanoseconds;
use crate::publication::Output;
use crate::view::header;

/// Period of the node's own work.
const TICK: std::time::Duration = std::time::Duration::from_millis(50);
/// Messages that wait for the node; the readers wait then, and DDS keeps the latest.
const QUEUE: usize = 1000;
/// The timeout that the bond's messages name, seconds, as nav2 has it.
const BOND_TIMEOUT: f32 = 4.0;

/// What the loop takes.
enum Event {
    Input(Input),
    Clock(Nanoseconds),
    Call(Call),
    Bytes(Option<Vec<u8>>),
    Tick,
}

/// A request of a service, which answers itself.
type Call = Box<dyn FnOnce(&mut Managed, Nanoseconds) + Send>;

/// Runs the node until it is shut down.
///
/// # Errors
/// If the network cannot be used, or a name is not valid.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let executor = Rc::new(LocalExecutor::new());
    smol::block_on(executor.run(async {
        let (queue, events) = async_channel::bounded(QUEUE);
        let mut program = Program::new(arguments, Rc::clone(&executor), queue)?;
        program.serve().context("cannot offer the services")?;
        if arguments.parameters.flag("autostart_node") {
            program.change(Transition::Configure)?;
            program.change(Transition::Activate)?;
        }
        program.loop_over(events).await
    }))
}

struct Program {
    managed: Managed,
    began: Instant,
    graph: Graph,
    /// Those that exist as long as the program.
    always: Publishers,
    /// Those of a configured node.
    publishers: Publishers,
    subscriptions: Vec<Task<()>>,
    link: Option<port::Link>,
    queue: Sender<Event>,
    executor: Rc<LocalExecutor<'static>>,
    /// The time of `/clock`, once one was received; `None`: the clock is that of the system.
    simulated: Option<Nanoseconds>,
    bond: Bond,
}

impl Program {
    fn new(
        arguments: &Arguments,
        executor: Rc<LocalExecutor<'static>>,
        queue: Sender<Event>,
    ) -> anyhow::Result<Self> {
        let names = Names {
            node: arguments.node.clone(),
            namespace: arguments.namespace.clone(),
            remaps: arguments.remaps.clone(),
        };
        let middleware = std::env::var("RMW_IMPLEMENTATION").unwrap_or_default();
        let domain = std::env::var("ROS_DOMAIN_ID").ok().and_then(|text| text.parse().ok());
        let mapping = mapping(&middleware);
        let graph = Graph::join(names.clone(), mapping, domain.unwrap_or(0), Rc::clone(&executor))?;
        let parameters = arguments.parameters.clone();
        let is_simulated = parameters.flag("use_sim_time");
        let mut program = Self {
            managed: Managed::new(names.full_name(), parameters),
            began: Instant::now(),
            graph,
            always: Publishers::default(),
            publishers: Publishers::default(),
            subscriptions: Vec::new(),
            link: None,
            queue,
            executor,
            bond: Bond::new(&names.node),
            simulated: is_simulated.then_some(0),
        };
        program.begin(is_simulated)?;
        Ok(program)
    }

    /// The clock, the ticks, and what is published in every state.
    fn begin(&mut self, is_simulated: bool) -> anyhow::Result<()> {
        if is_simulated {
            let wrap = |message: Option<Clock>| match message {
                Some(message) => Event::Clock(message.clock.nanoseconds()),
                None => Event::Input(Input::Undecodable),
            };
            let clock = self.graph.subscribe("/clock", Quality::BestEffort, &self.queue, wrap)?;
            clock.detach();
        }
        let queue = self.queue.clone();
        let ticks = async move {
            while queue.send(Event::Tick).await.is_ok() {
                Timer::after(TICK).await;
            }
        };
        self.executor.spawn(ticks).detach();
        let (graph, always) = (&mut self.graph, &mut self.always);
        graph.publish_as::<TransitionEvent>(
            always,
            "event",
            "~/transition_event",
            ("lifecycle_msgs", "TransitionEvent"),
            Quality::Reliable,
        )?;
        graph.publish_as::<ParameterEvent>(
            always,
            "parameters",
            "/parameter_events",
            ("rcl_interfaces", "ParameterEvent"),
            Quality::Reliable,
        )?;
        graph.publish::<Status>(always, "bond", "/bond", Quality::Reliable)
    }

    fn now(&self) -> Nanoseconds {
        self.simulated.unwrap_or_else(system_time)
    }

    fn call<Req, Resp>(
        &mut self,
        service: &str,
        kind: (&str, &str),
        answer: fn(&mut Managed, Req, Nanoseconds) -> Resp,
    ) -> anyhow::Result<()>
    where
        Req: ros2_client::Message + Clone + Send + 'static,
        Resp: ros2_client::Message + Send + 'static,
    {
        let wrap = move |request: Req, response: Sender<Resp>| {
            Event::Call(Box::new(move |managed, now| {
                // The receiver waits for exactly this one.
                _ = response.try_send(answer(managed, request, now));
            }))
        };
        self.graph.serve(service, kind, &self.queue, wrap)
    }

    /// Offers the services.
    fn serve(&mut self) -> anyhow::Result<()> {
        self.serve_lifecycle()?;
        self.serve_parameters()?;
        self.call(
            "reinitialize_global_localization",
            ("std_srvs", "Empty"),
            |managed, _: Empty, now| {
                managed.take(Input::SearchAnywhere, now);
                Empty::default()
            },
        )?;
        self.call("request_nomotion_update", ("std_srvs", "Empty"), |managed, _: Empty, now| {
            managed.take(Input::PublishNow, now);
            Empty::default()
        })?;
        self.call(
            "set_initial_pose",
            ("nav2_msgs", "SetInitialPose"),
            |managed, request: SetInitialPoseRequest, now| {
                managed.set_pose(request.pose, now);
                Empty::default()
            },
        )?;
        let kind = ("std_srvs", "Trigger");
        self.call::<Empty, TriggerResponse>("~/start", kind, |managed, _, _| {
            managed.command(Command::Start)
        })?;
        self.call::<Empty, TriggerResponse>("~/stop", kind, |managed, _, _| {
            managed.command(Command::Stop)
        })?;
        self.call::<Empty, TriggerResponse>("~/reset_calibration", kind, |managed, _, _| {
            managed.command(Command::ResetCalibration)
        })
    }

    fn serve_lifecycle(&mut self) -> anyhow::Result<()> {
        let kind = |name| ("lifecycle_msgs", name);
        self.call::<ChangeStateRequest, ChangeStateResponse>(
            "~/change_state",
            kind("ChangeState"),
            |managed, request, now| managed.change_state(&request, now),
        )?;
        self.call::<Empty, GetStateResponse>("~/get_state", kind("GetState"), |managed, _, _| {
            managed.get_state()
        })?;
        self.call::<Empty, GetAvailableStatesResponse>(
            "~/get_available_states",
            kind("GetAvailableStates"),
            |_, _, _| managed::available_states(),
        )?;
        self.call::<Empty, GetAvailableTransitionsResponse>(
            "~/get_available_transitions",
            kind("GetAvailableTransitions"),
            |managed, _, _| managed::transitions(&[managed.state()]),
        )?;
        self.call::<Empty, GetAvailableTransitionsResponse>(
            "~/get_transition_graph",
            kind("GetAvailableTransitions"),
            |_, _, _| managed::transitions(&State::ALL),
        )
    }

    fn serve_parameters(&mut self) -> anyhow::Result<()> {
        let kind = |name| ("rcl_interfaces", name);
        self.call::<ParameterNames, GetParametersResponse>(
            "~/get_parameters",
            kind("GetParameters"),
            |managed, request, _| managed.get_parameters(&request),
        )?;
        self.call::<ParameterNames, GetParameterTypesResponse>(
            "~/get_parameter_types",
            kind("GetParameterTypes"),
            |managed, request, _| managed.get_parameter_types(&request),
        )?;
        self.call::<ParameterNames, DescribeParametersResponse>(
            "~/describe_parameters",
            kind("DescribeParameters"),
            |managed, request, _| managed.describe_parameters(&request),
        )?;
        self.call::<SetParametersRequest, SetParametersResponse>(
            "~/set_parameters",
            kind("SetParameters"),
            |managed, request, now| managed.set_parameters(&request, now),
        )?;
        self.call::<SetParametersRequest, SetParametersAtomicallyResponse>(
            "~/set_parameters_atomically",
            kind("SetParametersAtomically"),
            |managed, request, now| managed.set_atomically(&request, now),
        )?;
        self.call::<ListParametersRequest, ListParametersResponse>(
            "~/list_parameters",
            kind("ListParameters"),
            |managed, request, _| managed.list_parameters(&request),
        )
    }

    /// Makes a transition that nobody has asked for.
    fn change(&mut self, transition: Transition) -> anyhow::Result<()> {
        let has_succeeded = self.managed.change(transition, self.now());
        self.perform()?;
        anyhow::ensure!(
            has_succeeded,
            "autostart_node: the transition {} has failed",
            transition.label()
        );
        Ok(())
    }

    async fn loop_over(&mut self, events: Receiver<Event>) -> anyhow::Result<()> {
        while let Ok(event) = events.recv().await {
            match event {
                Event::Input(input) => self.managed.take(input, self.now()),
                Event::Clock(now) => {
                    self.simulated = Some(now);
                    self.managed.take(Input::Tick, now);
                }
                Event::Call(call) => {
                    let now = self.now();
                    call(&mut self.managed, now);
                }
                Event::Bytes(bytes) => self.managed.take_bytes(bytes.as_deref(), self.now()),
                Event::Tick => self.tick(),
            }
            self.perform()?;
            if self.managed.state() == State::Finalized {
                break;
            }
        }
        // The response to the request, the last event and the last velocity leave before the end.
        Timer::after(std::time::Duration::from_millis(200)).await;
        Ok(())
    }

    fn tick(&mut self) {
        let now = self.now();
        // A simulated clock that stands is no time that passes.
        if self.simulated != Some(0) {
            self.managed.take(Input::Tick, now);
        }
        let to_send = self.managed.to_send(self.began.elapsed(), now);
        if let (Some(link), Some(bytes)) = (&self.link, to_send) {
            link.send(bytes);
        }
        let period = self.managed.parameters().number("bond_heartbeat_period");
        let is_active = self.managed.state() == State::Active;
        if let Some(status) = self.bond.due(is_active, period, now) {
            self.always.publish("bond", status);
        }
    }

    /// Does what the managed node asks for.
    fn perform(&mut self) -> anyhow::Result<()> {
        for effect in self.managed.effects() {
            match effect {
                Effect::Publish(output) => self.publish(output),
                Effect::Changed(change, event) => {
                    self.always.publish("event", event);
                    eprintln!("{}: {}", change.transition.label(), change.to.label());
                    match (change.from, change.to) {
                        (State::Unconfigured, State::Inactive) => self.connect()?,
                        (_, State::Unconfigured) => self.disconnect(),
                        _ => {}
                    }
                }
                Effect::Parameters(event) => self.always.publish("parameters", event),
                Effect::Note(note) => eprintln!("{note}"),
            }
        }
        Ok(())
    }

    fn publish(&self, output: Output) {
        let publishers = &self.publishers;
        match output {
            Output::Pose(message) => publishers.publish("pose", *message),
            Output::Transforms(message) => publishers.publish("tf", message),
            Output::Diagnostics(message) => publishers.publish("diagnostics", message),
            Output::Markers(message) => publishers.publish("markers", message),
            Output::Calibration(message) => publishers.publish("calibration", message),
            Output::Particles(message) => publishers.publish("particles", message),
            Output::Odometry(message) => publishers.publish("odom", *message),
            Output::Range(message) => publishers.publish("range", message),
            Output::Velocity(message) => publishers.publish("velocity", message),
        }
    }

    /// Creates the topics of a configured node.
    fn connect(&mut self) -> anyhow::Result<()> {
        let parameters = self.managed.parameters().clone();
        let text = |name: &str| parameters.text(name).to_owned();
        let (graph, publishers) = (&mut self.graph, &mut self.publishers);
        graph.publish::<PoseWithCovarianceStamped>(
            publishers,
            "pose",
            &text("pose_topic"),
            Quality::Latched,
        )?;
        graph.publish::<TFMessage>(publishers, "tf", "/tf", Quality::Reliable)?;
        graph.publish::<DiagnosticArray>(
            publishers,
            "diagnostics",
            "/diagnostics",
            Quality::Reliable,
        )?;
        graph.publish::<DiagnosticArray>(
            publishers,
            "calibration",
            "~/calibration",
            Quality::Reliable,
        )?;
        graph.publish::<MarkerArray>(publishers, "markers", "~/markers", Quality::Reliable)?;
        graph.publish::<ParticleCloud>(
            publishers,
            "particles",
            "particle_cloud",
            Quality::BestEffort,
        )?;
        self.listen("initialpose", Quality::Reliable, |pose: PoseWithCovarianceStamped| {
            Input::InitialPose(Box::new(pose))
        })?;
        if parameters.text("mode") == "bridge" {
            let (graph, publishers) = (&mut self.graph, &mut self.publishers);
            graph.publish::<Odometry>(
                publishers,
                "odom",
                &text("odom_topic"),
                Quality::Reliable,
            )?;
            graph.publish::<Range>(publishers, "range", "~/range", Quality::BestEffort)?;
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "the range ends at 4 million"
            )]
            let baud = parameters.number("baud") as u32;
            let queue = self.queue.clone();
            let take = move |bytes| queue.send_blocking(Event::Bytes(bytes)).is_ok();
            self.link = Some(port::Link::open(text("port"), baud, take));
            return Ok(());
        }
        let (graph, publishers) = (&mut self.graph, &mut self.publishers);
        let topic = text("search_motion_topic");
        if !topic.is_empty() {
            graph.publish::<Twist>(publishers, "velocity", &topic, Quality::Reliable)?;
        }
        self.listen_to_robot(&parameters)
    }

    fn listen_to_robot(
        &mut self,
        parameters: &crate::parameters::Parameters,
    ) -> anyhow::Result<()> {
        let text = |name: &str| parameters.text(name).to_owned();
        self.listen("/tf", Quality::Reliable, Input::Transforms)?;
        self.listen("/tf_static", Quality::Latched, Input::StaticTransforms)?;
        if parameters.text("map_file").is_empty() {
            self.listen(&text("map_topic"), Quality::Latched, |grid: OccupancyGrid| {
                Input::Map(grid)
            })?;
        }
        if parameters.text("odometry_source") == "joints" {
            self.listen(&text("joint_topic"), Quality::BestEffort, |joints: JointState| {
                Input::Joints(joints)
            })?;
        } else {
            self.listen(&text("odom_topic"), Quality::BestEffort, |message: Odometry| {
                Input::Odometry(Box::new(message))
            })?;
        }
        for (place, topic) in parameters.texts("range_topics").iter().enumerate() {
            let wrap = move |message: Option<RangeHeard>| {
                Event::Input(message.map_or(Input::Undecodable, |range| Input::Range(place, range)))
            };
            let kind = ("sensor_msgs", "Range");
            let task =
                self.graph.subscribe_as(topic, kind, Quality::BestEffort, &self.queue, wrap)?;
            self.subscriptions.push(task);
        }
        if !text("scan_topic").is_empty() {
            self.listen(&text("scan_topic"), Quality::BestEffort, |scan: LaserScan| {
                Input::Scan(scan)
            })?;
        }
        if !text("imu_topic").is_empty() {
            self.listen(&text("imu_topic"), Quality::BestEffort, |imu: Imu| {
                Input::Imu(Box::new(imu))
            })?;
        }
        Ok(())
    }

    fn listen<T>(
        &mut self,
        topic: &str,
        quality: Quality,
        wrap: fn(T) -> Input,
    ) -> anyhow::Result<()>
    where
        T: serde::de::DeserializeOwned + sonarfix_ros_messages::schema::Message + 'static,
    {
        let wrap = move |message: Option<T>| Event::Input(message.map_or(Input::Undecodable, wrap));
        let task = self.graph.subscribe(topic, quality, &self.queue, wrap)?;
        self.subscriptions.push(task);
        Ok(())
    }

    /// Removes the topics of a configured node.
    fn disconnect(&mut self) {
        self.subscriptions.clear();
        self.publishers = Publishers::default();
        self.link = None;
    }
}

/// The bond with a lifecycle manager: it takes a node without heartbeats for dead.
struct Bond {
    id: String,
    instance: String,
    was_active: bool,
    last: Option<Instant>,
}

impl Bond {
    fn new(node: &str) -> Self {
        let instance = format!("{}-{}", std::process::id(), system_time());
        Self { id: node.to_owned(), instance, was_active: false, last: None }
    }

    /// The heartbeat that is due, or the end of the bond.
    fn due(&mut self, is_active: bool, period: f64, now: Nanoseconds) -> Option<Status> {
        let has_ended = std::mem::replace(&mut self.was_active, is_active) && !is_active;
        let is_early = self.last.is_some_and(|last| last.elapsed().as_secs_f64() < period);
        if period <= 0.0 || !(has_ended || (is_active && !is_early)) {
            return None;
        }
        self.last = Some(Instant::now());
        #[expect(clippy::cast_possible_truncation, reason = "a period of seconds")]
        let heartbeat_period = period as f32;
        Some(Status {
            header: header(now, ""),
            id: self.id.clone(),
            instance_id: self.instance.clone(),
            active: is_active,
            heartbeat_timeout: BOND_TIMEOUT,
            heartbeat_period,
        })
    }
}

fn system_time() -> Nanoseconds {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
}
