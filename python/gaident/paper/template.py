"""The text of the page; what stands after a dollar sign is filled in by page.py."""

from __future__ import annotations

from string import Template

__all__ = ["PAGE"]

PAGE = Template("""\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>gaident: the paper, reproduced</title>
<style>
body { max-width: 62rem; margin: 2rem auto; padding: 0 1rem; color: #111; background: #fff;
       font: 16px/1.5 system-ui, "Helvetica Neue", Arial, sans-serif; }
h1 { font-size: 1.7rem; line-height: 1.2; }
h2 { margin-top: 2.4rem; border-bottom: 1px solid #bbb; }
h3 { margin: 1.6rem 0 0.2rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; margin: 0.8rem 0 0.3rem; font-variant-numeric: tabular-nums; font-size: 0.92rem; }
th, td { padding: 0.12rem 0.6rem; text-align: right; vertical-align: bottom; }
td { white-space: nowrap; }
th:first-child, td:first-child { text-align: left; padding-left: 0; }
thead tr:last-child th { border-bottom: 1px solid #111; }
thead tr.groups th { border-bottom: 1px solid #bbb; text-align: center; }
tbody tr:last-child td { border-bottom: 1px solid #111; }
tbody tr.new td { border-top: 1px solid #bbb; }
figure { margin: 1.4rem 0; }
figure img { width: 100%; height: auto; }
figcaption, .caption { color: #333; font-size: 0.92rem; margin-top: 0.2rem; }
.box { background: #f3f3f3; padding: 0.5rem 1rem; border-left: 4px solid #0072b2; }
.wrong { border-left-color: #d55e00; }
@media print {
  body { max-width: none; margin: 0; font-size: 10pt; }
  h2, h3 { break-after: avoid; }
  figure, table, .box { break-inside: avoid; }
  .scroll { overflow: visible; }
}
</style>
</head>
<body>
<h1>The paper, reproduced and checked</h1>
<p>&ldquo;GA-Based Evolutionary Identification Algorithm for Unknown Structured Mechatronic Systems&rdquo;. Four parts: what
follows from the paper&rsquo;s own numbers, its experiment repeated on a simulated rig, the conventional method on the same
rig, and the friction that the paper only suspects.</p>

<p class="box"><b>Reproduced from the paper&rsquo;s own numbers.</b> Table III gives the nominal column of Table IV (within
$nominal_percent %, the rounding of the sheet values). The identified poles and zeros of Table IV give its mechanical
parameters to the printed digits. Table IV gives all fourteen coefficients of Table V&rsquo;s proposed columns (within
$table_v_worst of the largest coefficient), if the loop gain is scaled: see (1).</p>

<p class="box"><b>Simulated in place of the original rig</b>, whose measurements are not published: everything that needs a
record, that is Figs. 6, 7 and 8, the fitness figures and identified columns of Table IV, the least-squares columns of Table
V, and the friction; times are measured here. The masses, the shaft and the controller are those of Table III; the friction
and the noise are our choice.</p>

<p class="box wrong"><b>Where the paper disagrees with itself.</b> (1) With the printed gains K<sub>PV</sub>, K<sub>IV</sub>,
Table V does not follow from Table IV. With the loop gain times $factor_one (one mass) and $factor_two (two masses) it does,
all coefficients at once: the gains of the experiment were others than those printed, or in other units. (2) The identified
two-mass column is no two-mass system without shaft damping: the product of its poles gives K<sub>G</sub> = $KG_product N
m/rad (printed: $KG_printed), the sum of their pairwise products $KG_pairwise. (3) The two methods of Table V agree in their
coefficients to $apart_percent % of the largest, which the paper takes for precision. The mechanics behind the coefficients do
not agree: J is $J_proposed by one and $J_conventional kg&thinsp;m<sup>2</sup> by the other for one mass, J<sub>L</sub>
$JL_proposed and $JL_conventional for two. (4) Table III and the nominal column of Table IV differ by up to $nominal_percent
%: Table IV presumably comes from values with more digits.</p>

<h2>1. From the paper&rsquo;s own numbers</h2>
<h3>Table III to the nominal column of Table IV</h3>
$nominal_table
<h3>Table IV: from identified poles and zeros to mechanical parameters</h3>
$mechanics_table
<p>Six numbers (K, three poles, two zeros) over-determine the five parameters of two masses at D<sub>G</sub> = 0. The
paper&rsquo;s digits are those of the product equation; the two equations for K<sub>G</sub> are $gap_percent % apart. With
damping in the shaft all six numbers are met; and dry friction mimics it: on the simulated rig, whose shaft has no damping,
the two equations are $rig_gap_percent % apart on the step of part 2.</p>
<h3>Table V from Table IV</h3>
$table_v
<p>One factor on the loop gain meets all coefficients at once, so the bilinear transformation and the algebraic loop are as
the paper describes them, and only the printed gains are not those of the experiment.</p>
$behind_table
<p>The mechanics behind the conventional columns (not in the paper), by the same loop and the same factor. The coefficients of
a finely sampled difference equation agree long before the mechanics do.</p>

<h2>2. The experiment, on a rig in place of the rig</h2>
<p>The rig: the masses and the shaft of Table III; dry friction at the motor, $Tc N m, at standstill $Ts N m, Stribeck
velocity $vs rad/s, chosen so that the nominal model misfits about as much as the paper&rsquo;s; the PI loop with the printed
gains, digital as the paper says ($dt ms, torque held); noise of $noise rad/s on the velocity that the controller reads. It
is integrated in $substeps steps per sample by code that shares nothing with the package&rsquo;s simulation.</p>
$fig6
<p>Fitness of the nominal model: $nominal_one and $nominal_two. The paper prints $paper_nominal_one and
$paper_nominal_two.</p>
<h3>Table IV for this rig</h3>
$table_iv
<p>The paper prints fitness $paper_identified_one and $paper_identified_two for its identified models. With the paper&rsquo;s
bilinear model of the loop instead of the digital one the default engine ends at $bilinear_one and $bilinear_two.</p>
$fig7
<h3>Trials and time</h3>
$engines_table
<p>The paper: within $paper_generation ms per generation and $paper_seconds s in all, on a TMS320C30 at 33 MHz. Here:
processor time of one thread, the fastest of three runs, measured while this page was made; a call contains its preparation
and report, and that of the default engine also its local fits, standard deviations and tests, so only the time in all
compares. &ldquo;At the optimum&rdquo;: right structure and an error sum within 10 % of the best one known.</p>
<p>The paper&rsquo;s own two-mass fitness is far below what its algorithm reaches here, for two reasons. As printed it keeps no
elite, so it loses good candidates. And the printed gains make a soft loop, in which a wrong model
shows more: on the same rig with the loop gain of Table V the nominal model has fitness $scaled_nominal_one and
$scaled_nominal_two, and the best trial of the paper&rsquo;s algorithm ends at $scaled_best_one and $scaled_best_two (mean
$scaled_mean_one and $scaled_mean_two).</p>
$fig8

<h2>3. Against the conventional method</h2>
<p>Equation (7) on the same rig with an M-sequence as velocity command ($samples samples, &plusmn;$amplitude rad/s), $seeds
noise seeds. Plain least squares is the paper&rsquo;s conventional method. Instruments and whitening take the bias of the
noise out of it. Both are told the order, the genetic identification is not; its bias and spread
are those of the runs that end in the true structure. The least-squares code shares nothing with the
genetic one.</p>
<h3>One mass</h3>
$conventional_one
$bias_one_mass
<h3>Two masses</h3>
$conventional_two
$bias_two_masses
<p>Noise on the velocity stands in the regressors of equation (7), and at this sampling it biases plain least squares beyond
use; the paper&rsquo;s columns agree with each other, so its records were presumably cleaner than $noise rad/s or averaged,
which it does not say. Without friction the two unbiased methods agree with each other and with the
truth. In the coefficients the genetic identification spreads less, as the known controller is built into it. In the
mechanics, for which the way back from the polynomial uses the controller too, the regression, told the order, spreads no
more with one mass and less with two: K<sub>G</sub> by $KG_spread_refined % against $KG_spread_genetic %. With friction every
linear method is biased, the genetic one too: the damping by $damping_one % and $damping_two %.</p>

<h2>4. Beyond the paper: the friction it suspects</h2>
<p>The paper blames &ldquo;unstructured uncertainties, e.g., nonlinear friction&rdquo; for the misfit of the nominal model and
lets the linear parameters absorb it. That looks adequate, because a step in one direction cannot show dry friction: it is a
constant torque there, which the integrator cancels and J and D take up. Commands that reverse show it, <code>gaident
diagnose</code> names it, and with it in the model the mechanical parameters return to nominal.</p>
<h3>One mass</h3>
$friction_table_one
<p>$friction_words_one</p>
$friction_one_mass
<h3>Two masses</h3>
$friction_table_two
<p>$friction_words_two</p>
$friction_two_masses

<h2>How this page was made</h2>
<p>gaident $version, <code>gaident reproduce</code>, seed $seed, $trials trials per engine, $seeds noise seeds; computed in
$seconds s ($cpu_seconds s of processor time, $processors processors). The same seed gives the same numbers, times apart.</p>
</body>
</html>
""")
