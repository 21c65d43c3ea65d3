// What the thread of sim_node does, in C++ on rcl: a peer of benchmarks/node.py.
//
// Each period it looks at the four command topics, sleeps to the deadline, makes a step of fourth
// order and publishes the state as odom and pose, with the quality of service of sim_node. On SIGINT
// it prints how late it woke up for the last 4,096 deadlines. It has no executor, services,
// parameters or checks. The step is that of a point with drag and a turning
// attitude: the equations of a disc take 0.5 us, which does not show at these rates.
//
// It is a library that benchmarks/node_roles.py builds and calls, because the ROS wheels on PyPI
// work within a Python process alone.

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include <geometry_msgs/msg/pose_stamped.h>
#include <geometry_msgs/msg/vector3_stamped.h>
#include <geometry_msgs/msg/wrench_stamped.h>
#include <nav_msgs/msg/odometry.h>
#include <rcl/error_handling.h>
#include <rcl/rcl.h>
#include <rosidl_runtime_c/string_functions.h>

namespace {

using State = std::array<double, 13>;  // position, velocity, quaternion w x y z, rates

void check(rcl_ret_t code, const char* what) {
  if (code != RCL_RET_OK) {
    std::fprintf(stderr, "rcl_loop: %s: %s\n", what, rcl_get_error_string().str);
    std::exit(1);
  }
}

volatile std::sig_atomic_t ended = 0;

double monotonic() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}

State derivative(const State& s, double control) {
  const double V = std::sqrt(s[3] * s[3] + s[4] * s[4] + s[5] * s[5]);
  State d{};
  for (int i = 0; i < 3; ++i) {
    d[i] = s[3 + i];
    d[3 + i] = -0.01 * V * s[3 + i];
  }
  d[5] -= 9.81;
  const double w = s[6], x = s[7], y = s[8], z = s[9], p = s[10], q = s[11], r = s[12];
  d[6] = -0.5 * (x * p + y * q + z * r);
  d[7] = 0.5 * (w * p + y * r - z * q);
  d[8] = 0.5 * (w * q + z * p - x * r);
  d[9] = 0.5 * (w * r + x * q - y * p);
  d[10] = control - 0.1 * p;
  d[11] = -0.1 * q;
  d[12] = -0.01 * r;
  return d;
}

State step(const State& s, double h, double control) {
  State k = derivative(s, control), sum = k;
  for (int stage = 1; stage < 4; ++stage) {
    State x = s;
    for (std::size_t i = 0; i < s.size(); ++i) x[i] += (stage < 3 ? 0.5 : 1.0) * h * k[i];
    k = derivative(x, control);
    for (std::size_t i = 0; i < s.size(); ++i) sum[i] += (stage < 3 ? 2.0 : 1.0) * k[i];
  }
  State next = s;
  for (std::size_t i = 0; i < s.size(); ++i) next[i] += h / 6.0 * sum[i];
  return next;
}

}  // namespace

// Run until SIGINT, then print seconds, one a line.
extern "C" void rcl_loop(double rate) {
  struct sigaction end {};
  end.sa_handler = [](int) { ended = 1; };
  sigaction(SIGINT, &end, nullptr);
  static std::array<double, 4096> late{};
  const double period = 1.0 / rate;
  rcl_allocator_t allocator = rcl_get_default_allocator();
  rcl_init_options_t options = rcl_get_zero_initialized_init_options();
  check(rcl_init_options_init(&options, allocator), "options");
  rcl_context_t context = rcl_get_zero_initialized_context();
  check(rcl_init(0, nullptr, &options, &context), "rcl_init");
  rcl_node_t node = rcl_get_zero_initialized_node();
  rcl_node_options_t node_options = rcl_node_get_default_options();
  check(rcl_node_init(&node, "rcl_loop", "", &context, &node_options), "node");

  rcl_publisher_options_t publisher_options = rcl_publisher_get_default_options();
  publisher_options.qos.depth = 2000;
  rcl_publisher_t odom = rcl_get_zero_initialized_publisher(), pose = odom;
  const auto* odometry_type = ROSIDL_GET_MSG_TYPE_SUPPORT(nav_msgs, msg, Odometry);
  const auto* pose_type = ROSIDL_GET_MSG_TYPE_SUPPORT(geometry_msgs, msg, PoseStamped);
  const auto* vector_type = ROSIDL_GET_MSG_TYPE_SUPPORT(geometry_msgs, msg, Vector3Stamped);
  const auto* wrench_type = ROSIDL_GET_MSG_TYPE_SUPPORT(geometry_msgs, msg, WrenchStamped);
  check(rcl_publisher_init(&odom, &node, odometry_type, "odom", &publisher_options), "odom");
  check(rcl_publisher_init(&pose, &node, pose_type, "pose", &publisher_options), "pose");
  rcl_subscription_options_t subscription_options = rcl_subscription_get_default_options();
  subscription_options.qos.depth = 100;
  const char* names[] = {"cmd_moment", "cmd_coefficients", "wind", "throw"};
  const rosidl_message_type_support_t* types[] = {wrench_type, vector_type, vector_type,
                                                  odometry_type};
  std::array<rcl_subscription_t, 4> subscriptions;
  for (int i = 0; i < 4; ++i) {
    subscriptions[i] = rcl_get_zero_initialized_subscription();
    check(rcl_subscription_init(&subscriptions[i], &node, types[i], names[i],
                                &subscription_options),
          names[i]);
  }

  nav_msgs__msg__Odometry motion, thrown;
  geometry_msgs__msg__PoseStamped place;
  geometry_msgs__msg__WrenchStamped moment;
  geometry_msgs__msg__Vector3Stamped coefficients, wind;
  nav_msgs__msg__Odometry__init(&motion);
  nav_msgs__msg__Odometry__init(&thrown);
  geometry_msgs__msg__PoseStamped__init(&place);
  geometry_msgs__msg__WrenchStamped__init(&moment);
  geometry_msgs__msg__Vector3Stamped__init(&coefficients);
  geometry_msgs__msg__Vector3Stamped__init(&wind);
  rosidl_runtime_c__String__assign(&motion.header.frame_id, "map");
  rosidl_runtime_c__String__assign(&motion.child_frame_id, "disc");
  rosidl_runtime_c__String__assign(&place.header.frame_id, "map");
  void* taken[] = {&moment, &coefficients, &wind, &thrown};

  State s{0, 0, 1000, 15, 0, 4, 1, 0, 0, 0, 0, 0, 30};
  double control = 0.0;
  const double epoch = monotonic();
  long n = 1;
  for (;; ++n) {
    for (int i = 0; i < 4; ++i) {
      while (rcl_take(&subscriptions[i], taken[i], nullptr, nullptr) == RCL_RET_OK) {
        if (i == 1 && std::abs(coefficients.vector.x) <= 10.0) control = coefficients.vector.x;
      }
      rcl_reset_error();
    }
    const double deadline = epoch + n * period;
    timespec until{static_cast<time_t>(deadline),
                   static_cast<long>((deadline - std::floor(deadline)) * 1e9)};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
    if (ended) break;
    late[n % late.size()] = monotonic() - deadline;
    s = step(s, period, control);
    const long stamp = static_cast<long>(1e9 * n * period);
    motion.header.stamp.sec = stamp / 1000000000;
    motion.header.stamp.nanosec = stamp % 1000000000;
    place.header.stamp = motion.header.stamp;
    auto& p = motion.pose.pose;
    p.position.x = s[0], p.position.y = s[1], p.position.z = s[2];
    p.orientation.w = s[6], p.orientation.x = s[7], p.orientation.y = s[8];
    p.orientation.z = s[9];
    auto& v = motion.twist.twist;
    v.linear.x = s[3], v.linear.y = s[4], v.linear.z = s[5];
    v.angular.x = s[10], v.angular.y = s[11], v.angular.z = s[12];
    place.pose = p;
    check(rcl_publish(&odom, &motion, nullptr), "publish");
    check(rcl_publish(&pose, &place, nullptr), "publish");
  }
  const long count = std::min<long>(n - 1, late.size());
  for (long i = n - count; i < n; ++i) std::printf("%.9f\n", late[i % late.size()]);
  std::fflush(stdout);
}
