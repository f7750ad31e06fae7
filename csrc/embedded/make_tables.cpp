// Run on the build machine: writes what a drive reads instead of computing it, as C++ that any arithmetic can take over
// (genes.hpp, record.hpp; record.h for C).
//
//     the values of all codes of a gene (the logarithm of K needs a libm, which a drive has not got)
//     the paper's two-mass record, Table IV's identified model with 0.3 rad/s of noise
#include "../gaident/genetic/genome.hpp"
#include "../gaident/reference/drives.hpp"

#include <cstdio>
#include <string>

using namespace gaident;

namespace {

// `const double name[n] = {at(0), at(1), ...};` behind `storage`.
template <class At>
void table(const char* storage, const char* name, std::size_t n, At&& at) {
    std::fprintf(stdout, "%s const double %s[%zu] = {\n", storage, name, n);
    for (std::size_t i = 0; i < n; ++i) std::fprintf(stdout, "%a,%s", at(i), i % 6 == 5 || i + 1 == n ? "\n" : " ");
    std::fprintf(stdout, "};\n");
}

void genes(const char* storage) {
    const Genome genome(SearchRanges{}, Code::binary, Scale::linear);
    const auto values = [&](const char* name, const Field& f) {
        table(storage, name, std::size_t{1} << f.width,
              [&](std::size_t bits) { return genome.value_of(static_cast<std::uint32_t>(bits), f); });
    };
    values("gain_values", genome.field(Role::gain, Part::whole, 0));
    values("real_values", genome.field(Role::pole1, Part::real, 0));
    values("imaginary_values", genome.field(Role::pole1, Part::imaginary, 0));
}

void record(const char* storage) {
    const reference::Drive drive = reference::paper_drive(true);
    const reference::Measurement measured(drive, 0.3, 17);
    table(storage, "recorded_command", measured.input.size(), [&](std::size_t i) { return measured.input[i]; });
    table(storage, "recorded_velocity", measured.output.size(), [&](std::size_t i) { return measured.output[i]; });
    std::fprintf(stdout, "%s const double recorded_kp = %a;\n%s const double recorded_ki = %a;\n", storage,
                 drive.loop.controller.kp, storage, drive.loop.controller.ki);
    std::fprintf(stdout, "%s const double recorded_sample_time = %a;\n", storage, drive.sample_time);
}

}  // namespace

// make_tables genes | make_tables record | make_tables record c
int main(int argc, char** argv) {
    const std::string what = argc > 1 ? argv[1] : "";
    const char* const storage = argc > 2 ? "static" : "inline constexpr";
    std::fprintf(stdout, "// Written by make_tables.cpp.\n%s\n", argc > 2 ? "enum { recorded_samples = 250 };" : "#pragma once");
    if (what == "genes") genes(storage);
    else if (what == "record") record(storage);
    else return 2;
    return 0;
}
