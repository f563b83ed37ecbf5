//! Reads each type of message and sends it back, for a proof of the bytes against another implementation of DDS.

use std::rc::Rc;

use serde::Serialize;
use serde::de::DeserializeOwned;
use smol::LocalExecutor;
use sonarfix_ros::graph::{Graph, Publishers, Quality, mapping};
use sonarfix_ros::names::Names;
use sonarfix_ros_messages::messages as of;
use sonarfix_ros_messages::schema::Message;

/// Sends a message back.
type Back = Box<dyn FnOnce(&Publishers)>;

/// A topic of its own for each type: `/echo/PACKAGE/NAME/in` and `/echo/PACKAGE/NAME/out`.
fn echo<T: Message + Serialize + DeserializeOwned + 'static>(
    graph: &mut Graph,
    publishers: &mut Publishers,
    queue: &async_channel::Sender<Back>,
) -> anyhow::Result<()> {
    let topic = |end: &str| format!("/echo/{}/{}/{end}", T::PACKAGE, T::NAME);
    let wrap = |message: Option<T>| -> Back {
        Box::new(move |publishers| match message {
            Some(message) => publishers.publish(T::NAME, message),
            None => eprintln!("{}: bytes that are no message", T::NAME),
        })
    };
    graph.publish::<T>(publishers, T::NAME, &topic("out"), Quality::Latched)?;
    graph.subscribe::<T, Back>(&topic("in"), Quality::Latched, queue, wrap)?.detach();
    Ok(())
}

macro_rules! echo_all {
    ($graph:expr, $publishers:expr, $queue:expr; $($name:ident)*) => {
        $(echo::<of::$name>($graph, $publishers, $queue)?;)*
    };
}

fn main() -> anyhow::Result<()> {
    let executor = Rc::new(LocalExecutor::new());
    let names = Names { node: "echo".to_owned(), namespace: "/".to_owned(), remaps: Vec::new() };
    let mut graph = Graph::join(names, mapping("rmw_cyclonedds_cpp"), 0, Rc::clone(&executor))?;
    let mut publishers = Publishers::default();
    let (queue, back) = async_channel::unbounded();
    echo_all!(&mut graph, &mut publishers, &queue;
        Clock PoseWithCovarianceStamped TFMessage Odometry OccupancyGrid JointState Range Imu LaserScan
        DiagnosticArray MarkerArray ParticleCloud Status Twist);
    smol::block_on(executor.run(async {
        while let Ok(back) = back.recv().await {
            back(&publishers);
        }
    }));
    Ok(())
}
