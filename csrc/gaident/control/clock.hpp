// When the controller reads, computes and gives its torque.
#pragma once

namespace gaident {

struct Clock {
    double period = 0.0;  // [s] Ts, from one sample of the controller to the next
    int log_every = 1;    // the record has a line for the first of so many samples
};

}  // namespace gaident
