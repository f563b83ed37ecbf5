//! Topics and services over DDS.

use std::collections::HashMap;
use std::rc::Rc;

use anyhow::Context as _;
use async_channel::Sender;
use futures_util::StreamExt;
use ros2_client::qos::QosProfile;
use ros2_client::{
    Context, Message, MessageTypeName, Name, Node, NodeName, NodeOptions, Publisher,
    ServiceMapping, ServiceTypeName,
};
use rustdds::QosPolicyBuilder;
use rustdds::policy::{Durability, History, Reliability};
use serde::Serialize;
use serde::de::DeserializeOwned;
use smol::{LocalExecutor, Task};
use sonarfix_ros_messages::schema;

use crate::discovered::Discovered;
use crate::names::Names;

/// The qualities of service, as AMCL and the drivers of sensors have them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quality {
    /// Sensors: the latest counts, and a lost one is not sent again.
    BestEffort,
    /// The usual one: each of the last messages arrives.
    Reliable,
    /// As before, and whoever comes later gets the last one.
    Latched,
}

impl Quality {
    fn policies(self, depth: i32) -> QosProfile {
        let reliable =
            Reliability::Reliable { max_blocking_time: rustdds::Duration::from_millis(100) };
        let (reliability, durability) = match self {
            Self::BestEffort => (Reliability::BestEffort, Durability::Volatile),
            Self::Reliable => (reliable, Durability::Volatile),
            Self::Latched => (reliable, Durability::TransientLocal),
        };
        let policies = QosPolicyBuilder::new()
            .reliability(reliability)
            .durability(durability)
            .history(History::KeepLast { depth })
            .build();
        (&policies).into()
    }
}

/// The messages that a topic keeps.
const DEPTH: i32 = 10;
/// As ROS keeps of transforms.
const TRANSFORMS: i32 = 100;

/// The node in the graph of ROS.
pub struct Graph {
    node: Node,
    name: NodeName,
    names: Names,
    discovered: Discovered,
    mapping: ServiceMapping,
    executor: Rc<LocalExecutor<'static>>,
}

/// A writer of any type.
type Writers = HashMap<&'static str, Box<dyn std::any::Any>>;

/// The publishers of the node, by the names that the node has for their topics.
#[derive(Default)]
pub struct Publishers(Writers);

impl Publishers {
    /// Publishes a message, if the topic exists.
    pub fn publish<T: Serialize + 'static>(&self, topic: &'static str, message: T) {
        let writer = self.0.get(topic).and_then(|writer| writer.downcast_ref::<Publisher<T>>());
        if let Some(writer) = writer {
            // A reader that does not keep up must not stop the node.
            _ = writer.publish(message);
        }
    }
}

/// The mapping of services of the middleware that the environment names: that of Eclipse Cyclone DDS differs from all others.
#[must_use]
pub fn mapping(middleware: &str) -> ServiceMapping {
    if middleware.contains("cyclonedds") {
        ServiceMapping::Cyclone
    } else {
        ServiceMapping::Enhanced
    }
}

impl Graph {
    /// Joins the graph.
    ///
    /// # Errors
    /// If the names are not valid, or there is no network.
    pub fn join(
        names: Names,
        mapping: ServiceMapping,
        domain: u16,
        executor: Rc<LocalExecutor<'static>>,
    ) -> anyhow::Result<Self> {
        let participant = rustdds::DomainParticipantBuilder::new(domain).build();
        let participant = participant.context("cannot join the network of DDS")?;
        let discovered = Discovered::watch(&participant, &executor);
        let context = Context::from_domain_participant(participant)?;
        let name = NodeName::new(&names.namespace, &names.node);
        let name = name.map_err(|error| anyhow::anyhow!("the node's name: {error:?}"))?;
        let options = NodeOptions::new().enable_rosout(false).start_parameter_services(false);
        let node = context.new_node(name.clone(), options);
        let node = node.map_err(|error| anyhow::anyhow!("cannot create the node: {error:?}"))?;
        Ok(Self { node, name, names, discovered, mapping, executor })
    }

    fn parsed(&self, name: &str) -> anyhow::Result<Name> {
        let full = self.names.resolve(name);
        Name::parse(&full).map_err(|error| anyhow::anyhow!("the name {full}: {error:?}"))
    }

    /// Reads a topic; each message goes through `wrap` into the queue. Dropping the task ends it.
    ///
    /// # Errors
    /// If the topic's name is not valid.
    pub fn subscribe<T, E>(
        &mut self,
        topic: &str,
        quality: Quality,
        queue: &Sender<E>,
        wrap: impl Fn(Option<T>) -> E + 'static,
    ) -> anyhow::Result<Task<()>>
    where
        T: DeserializeOwned + schema::Message + 'static,
        E: 'static,
    {
        self.subscribe_as::<T, E>(topic, (T::PACKAGE, T::NAME), quality, queue, wrap)
    }

    /// As [`Self::subscribe`], of a type that is read as the first fields of another.
    ///
    /// # Errors
    /// If the topic's name is not valid.
    pub fn subscribe_as<T, E>(
        &mut self,
        topic: &str,
        (package, kind): (&str, &str),
        quality: Quality,
        queue: &Sender<E>,
        wrap: impl Fn(Option<T>) -> E + 'static,
    ) -> anyhow::Result<Task<()>>
    where
        T: DeserializeOwned + 'static,
        E: 'static,
    {
        let depth = if kind == "TFMessage" { TRANSFORMS } else { DEPTH };
        let policies = quality.policies(depth);
        let name = self.parsed(topic)?;
        let topic =
            self.node.create_topic(&name, MessageTypeName::new(package, kind), &policies)?;
        let subscription = self.node.create_subscription::<T>(&topic, Some(policies))?;
        let queue = queue.clone();
        Ok(self.executor.spawn(async move {
            let mut stream = std::pin::pin!(subscription.async_stream());
            while let Some(message) = stream.next().await {
                let message = message.ok().map(|(message, _)| message);
                if queue.send(wrap(message)).await.is_err() {
                    break;
                }
            }
        }))
    }

    /// Creates a publisher of a topic, under the name that the node has for it.
    ///
    /// # Errors
    /// If the topic's name is not valid.
    pub fn publish<T: Serialize + schema::Message + 'static>(
        &mut self,
        publishers: &mut Publishers,
        key: &'static str,
        topic: &str,
        quality: Quality,
    ) -> anyhow::Result<()> {
        self.publish_as::<T>(publishers, key, topic, (T::PACKAGE, T::NAME), quality)
    }

    /// As [`Self::publish`], of a type of this name.
    ///
    /// # Errors
    /// If the topic's name is not valid.
    pub fn publish_as<T: Serialize + 'static>(
        &mut self,
        publishers: &mut Publishers,
        key: &'static str,
        topic: &str,
        (package, kind): (&str, &str),
        quality: Quality,
    ) -> anyhow::Result<()> {
        let depth = match (quality, kind) {
            (Quality::Latched, _) => 1,
            (_, "TFMessage") => TRANSFORMS,
            _ => DEPTH,
        };
        let policies = quality.policies(depth);
        let name = self.parsed(topic)?;
        let topic =
            self.node.create_topic(&name, MessageTypeName::new(package, kind), &policies)?;
        let publisher = self.node.create_publisher::<T>(&topic, Some(policies))?;
        publishers.0.insert(key, Box::new(publisher));
        Ok(())
    }

    /// Serves a service: each request goes through `wrap` into the queue, with the channel for its response.
    ///
    /// # Errors
    /// If the service's name is not valid.
    pub fn serve<Req, Resp, E>(
        &mut self,
        service: &str,
        (package, kind): (&str, &str),
        queue: &Sender<E>,
        wrap: impl Fn(Req, Sender<Resp>) -> E + 'static,
    ) -> anyhow::Result<()>
    where
        Req: Message + Clone + 'static,
        Resp: Message + 'static,
        E: 'static,
    {
        let policies = || Quality::Reliable.policies(DEPTH);
        let (name, kind) = (self.parsed(service)?, ServiceTypeName::new(package, kind));
        let server = self.node.create_server::<Req, Resp>(
            self.mapping,
            &name,
            &kind,
            policies(),
            policies(),
        )?;
        let queue = queue.clone();
        let responses = name.to_dds_name("rr", &self.name, "Reply");
        let discovered = self.discovered.clone();
        let answer = async move {
            let mut requests = std::pin::pin!(server.receive_request_stream());
            while let Some(request) = requests.next().await {
                let Ok((id, request)) = request else { continue };
                let (response, answered) = async_channel::bounded(1);
                if queue.send(wrap(request, response)).await.is_err() {
                    break;
                }
                if let Ok(response) = answered.recv().await {
                    discovered.reader_of(&responses, id.writer_gid).await;
                    // A client that has gone gets no answer.
                    _ = server.async_send_response(id, response).await;
                }
            }
        };
        self.executor.spawn(answer).detach();
        Ok(())
    }
}
