#include "check.hpp"
#include "gaident/control/controller.hpp"

using namespace gaident;

TEST_CASE("controller: proportional part and trapezoidal integral") {
    Loop loop;
    loop.controller.kp = 2.0;
    loop.controller.ki = 100.0;
    ControllerState<double> pi(loop.controller, Clock{1e-2});  // ki Ts/2 = 0.5
    CHECK_NEAR(pi.step(1.0), 2.0 + 0.5, 1e-15);
    CHECK_NEAR(pi.step(3.0), 6.0 + 0.5 + 0.5 * (3.0 + 1.0), 1e-15);
    CHECK_NEAR(pi.step(0.0), 0.0 + 2.5 + 0.5 * 3.0, 1e-15);
}

TEST_CASE("controller: the integral is clamped itself, so it leaves its limit at once") {
    Loop loop;
    loop.controller.kp = 1.0;
    loop.controller.ki = 100.0;
    loop.controller.integrator_limit = 2.0;
    loop.controller.torque_limit = 5.0;
    ControllerState<double> pi(loop.controller, Clock{1e-2});
    CHECK(pi.step(10.0) == 5.0);
    for (int i = 0; i < 5; ++i) CHECK(pi.step(1.0) == 3.0);  // I = 2, whatever was asked for
    CHECK_NEAR(pi.step(-2.0), -2.0 + (2.0 + 0.5 * (-2.0 + 1.0)), 1e-15);
    CHECK(pi.step(-50.0) == -5.0);
    CHECK(pi.step(0.0) == -2.0);
}

TEST_CASE("controller: a loop is limited only where it has a controller and a finite limit") {
    Loop loop;
    CHECK(!loop.limited());
    loop.controller.torque_limit = 1.0;
    CHECK(loop.limited());
    loop.kind = LoopKind::open;
    CHECK(!loop.limited());
    loop.kind = LoopKind::sampled;
    loop.controller.torque_limit = std::numeric_limits<double>::infinity();
    loop.controller.integrator_limit = 3.0;
    CHECK(loop.limited());
}
