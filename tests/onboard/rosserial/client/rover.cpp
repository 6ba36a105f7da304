// A rover on rosserial's own client library, with stdin and stdout for its serial line. Logs on stderr what it receives.
#include <fcntl.h>
#include <stdio.h>
#include <time.h>
#include <unistd.h>

#include "messages.h"
#include "ros/node_handle.h"

class Pipe {
 public:
  void init() { fcntl(0, F_SETFL, O_NONBLOCK); }
  int read() {
    unsigned char byte;
    return ::read(0, &byte, 1) == 1 ? byte : -1;
  }
  void write(const uint8_t *data, int length) {
    if (::write(1, data, length) != length) _exit(1);
  }
  unsigned long time() {
    timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1000UL + now.tv_nsec / 1000000UL;
  }
};

void drive(const geometry_msgs::Twist &twist) {
  fprintf(stderr, "cmd_vel %g %g\n", twist.values[0], twist.values[5]);
}

ros::NodeHandle_<Pipe, 4, 4, 128, 128> node;
ros::Subscriber<geometry_msgs::Twist> commands("cmd_vel", drive);
std_msgs::Int32 ticks;
ros::Publisher left("lwheel", &ticks), right("rwheel", &ticks);

int main() {
  node.initNode();
  node.subscribe(commands);
  node.advertise(left);
  node.advertise(right);
  bool reported = false;
  for (int i = 0; getppid() != 1; i++) {
    if (node.spinOnce() == ros::SPIN_TX_STOP_REQUESTED) fprintf(stderr, "tx stop\n");
    if (node.connected() && !reported) {
      reported = true;
      node.loginfo("swarmctl firmware 0123456789ab");
      int gain = 0;
      if (node.getParam("~gain", &gain)) fprintf(stderr, "gain %d\n", gain);
      fprintf(stderr, "now %u\n", node.now().sec);
    }
    if (i % 20 == 0) {
      ticks.data = i;
      left.publish(&ticks);
      ticks.data = -i;
      right.publish(&ticks);
    }
    usleep(1000);
  }
}
