// How many multiplications and additions per second this machine starts, in registers of one instruction set: what no sample loop
// can pass.
#pragma once

struct IssueRate {
    double multiply, add, both;  // [1/s], counted per number, not per register; `both`: half and half
};

IssueRate issue_rate_baseline(bool in_float);
IssueRate issue_rate_avx2(bool in_float);
IssueRate issue_rate_avx512(bool in_float);
