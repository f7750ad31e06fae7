// When the controller reads, computes and gives its torque.
#pragma once

namespace gaident {

struct Clock {
    double period = 0.0;  // [s] Ts, from one sample of the controller to the next; the record has one line for each
};

}  // namespace gaident
