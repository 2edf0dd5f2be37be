/* The paper's axis, equations (1)-(5) and (8)-(10), by CVODE (SUNDIALS): what a general stiff
 * solver with a right-hand side in C needs for an accuracy.
 *
 *   cvode SCENARIO REFERENCE_FILE
 *
 * writes the positions at every millisecond with tight tolerances to REFERENCE_FILE, then one
 * line per tolerance: relative tolerance, largest error of the position in m, best time in s,
 * evaluations of the right-hand side. BDF, dense Newton, the Jacobian by differences.
 * Numbers as in model-core/src/paper.rs.
 */
#include <cvode/cvode.h>
#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <time.h>

#define STATES 7
#define MOST_ROWS 4000
#define REPETITIONS 15

static const double SUPPLY_PA = 7e5, AMBIENT_PA = 101325.0, AMBIENT_K = 293.15, START_PA = 5.25e5;
static const double GAMMA = 1.4, R_GAS = 287.0, AREA = 4.909e-4, BORE = 0.025, STROKE = 0.5;
static const double DEAD_VOLUME = 2.5e-5, MASS = 2.0, B = 0.29, LAMBDA = 0.98;
static const double SIGMA0 = 9.14e5, SIGMA1 = 1327.0, SIGMA2 = 64.5, FC = 20.2, FS = 28.9;
static const double LEAK_M2 = 1e-7, FULL_M2 = 16.7e-6, VS = 5.03e-3, H_CHARGE = 50.0, H_DISCHARGE = 20.0, NULL_V = 5.0;

typedef struct {
    int smooth, step;
    double start_m;
    int rows;
    double held_v;
    double c1, psi_lambda;
    long calls;
} Axis;

static double wave_v(double t) { return NULL_V + 0.9 * sin(2.0 * M_PI * t); }

static double command_v(const Axis *axis, double t) {
    if (axis->step) return 4.0;
    return axis->smooth ? wave_v(t) : axis->held_v;
}

static double forward(const Axis *axis, double area, double pu, double tu, double pd) {
    double r = pd / pu, psi;
    if (r <= B) {
        psi = 1.0;
    } else if (r < LAMBDA) {
        double q = (r - B) / (1.0 - B);
        psi = sqrt(1.0 - q * q);
    } else {
        psi = (1.0 - r) / (1.0 - LAMBDA) * axis->psi_lambda;
    }
    double cd = 0.8153 + r * (0.0933 - 0.1038 * r);
    return area * cd * axis->c1 * pu / sqrt(tu) * psi;
}

static double orifice(const Axis *axis, double area, double p1, double t1, double p2, double t2) {
    return p1 < p2 ? -forward(axis, area, p2, t2, p1) : forward(axis, area, p1, t1, p2);
}

static double opened_m2(double opening_v) {
    double share = (opening_v - 0.3) / (5.0 - 0.3);
    share = share < 0.0 ? 0.0 : share > 1.0 ? 1.0 : share;
    return LEAK_M2 + share * (FULL_M2 - LEAK_M2);
}

static void chamber(const Axis *axis, double p, double t, double length, double growth,
                    double opening, double *dp, double *dt) {
    double volume = DEAD_VOLUME + AREA * length, volume_rate = AREA * growth;
    double surface = 2.0 * AREA + M_PI * BORE * length;
    double in = orifice(axis, opened_m2(opening), SUPPLY_PA, AMBIENT_K, p, t);
    double out = orifice(axis, opened_m2(-opening), p, t, AMBIENT_PA, AMBIENT_K);
    double m_in = fmax(in, 0.0) + fmax(-out, 0.0), m_out = fmax(out, 0.0) + fmax(-in, 0.0);
    double heat = (m_in >= m_out ? H_CHARGE : H_DISCHARGE) * surface * (AMBIENT_K - t);
    *dp = (-GAMMA * p * volume_rate + GAMMA * R_GAS * (m_in * AMBIENT_K - m_out * t) +
           (GAMMA - 1.0) * heat) / volume;
    double per = t / (p * volume);
    *dt = (1.0 - GAMMA) * t * volume_rate / volume +
          R_GAS * per * (m_in * (GAMMA * AMBIENT_K - t) - m_out * (GAMMA - 1.0) * t) +
          (GAMMA - 1.0) * per * heat;
}

static int rates(realtype t, N_Vector state, N_Vector rate, void *user) {
    Axis *axis = user;
    const double *y = N_VGetArrayPointer(state);
    double *f = N_VGetArrayPointer(rate);
    double x = y[4], v = y[5], z = y[6], opening = command_v(axis, t) - NULL_V;
    axis->calls++;
    chamber(axis, y[0], y[1], 0.5 * STROKE + x, v, opening, &f[0], &f[1]);
    chamber(axis, y[2], y[3], 0.5 * STROKE - x, -v, -opening, &f[2], &f[3]);
    double ratio = v / VS, g = FC + (FS - FC) * exp(-ratio * ratio);
    double bend = v - SIGMA0 * fabs(v) / g * z;
    f[4] = v;
    f[5] = ((y[0] - y[2]) * AREA - SIGMA0 * z - SIGMA1 * bend - SIGMA2 * v) / MASS;
    f[6] = bend;
    return 0;
}

/* One run; positions at every millisecond. */
static void run(Axis *axis, double tolerance, double *positions) {
    static const double size[STATES] = {1e5, 300.0, 1e5, 300.0, 0.1, 0.1, 2e-5};
    SUNContext context;
    SUNContext_Create(NULL, &context);
    N_Vector y = N_VNew_Serial(STATES, context), absolute = N_VNew_Serial(STATES, context);
    double *s = N_VGetArrayPointer(y);
    for (int i = 0; i < STATES; i++) N_VGetArrayPointer(absolute)[i] = tolerance * size[i];
    s[0] = s[2] = START_PA;
    s[1] = s[3] = AMBIENT_K;
    s[4] = axis->start_m;
    s[5] = s[6] = 0.0;
    axis->held_v = wave_v(0.0);
    void *solver = CVodeCreate(CV_BDF, context);
    CVodeInit(solver, rates, 0.0, y);
    CVodeSVtolerances(solver, tolerance, absolute);
    CVodeSetUserData(solver, axis);
    CVodeSetMaxNumSteps(solver, 10000000);
    SUNMatrix matrix = SUNDenseMatrix(STATES, STATES, context);
    SUNLinearSolver linear = SUNLinSol_Dense(y, matrix, context);
    CVodeSetLinearSolver(solver, linear, matrix);
    for (int row = 0; row < axis->rows; row++) {
        double t, end = 1e-3 * (row + 1);
        if (!axis->smooth && !axis->step) {
            /* A command that jumps: the solver begins anew, as its manual asks for. */
            axis->held_v = wave_v(1e-3 * row);
            if (row > 0) CVodeReInit(solver, 1e-3 * row, y);
            CVodeSetStopTime(solver, end);
        }
        if (CVode(solver, end, y, &t, CV_NORMAL) < 0) exit(1);
        positions[row] = s[4];
    }
    CVodeFree(&solver);
    SUNLinSolFree(linear);
    SUNMatDestroy(matrix);
    N_VDestroy(y);
    N_VDestroy(absolute);
    SUNContext_Free(&context);
}

static double now_s(void) {
    struct timespec at;
    clock_gettime(CLOCK_MONOTONIC, &at);
    return (double)at.tv_sec + 1e-9 * (double)at.tv_nsec;
}

int main(int count, char **words) {
    static double exact[MOST_ROWS], found[MOST_ROWS];
    if (count != 3) return 2;
    Axis axis = {0};
    axis.step = !strcmp(words[1], "step");
    axis.smooth = !strcmp(words[1], "smooth");
    axis.start_m = axis.step ? 0.18 : -0.05;
    axis.rows = axis.step ? 400 : 1000;
    axis.c1 = sqrt(GAMMA / R_GAS * pow(2.0 / (GAMMA + 1.0), (GAMMA + 1.0) / (GAMMA - 1.0)));
    axis.psi_lambda = sqrt(1.0 - pow((LAMBDA - B) / (1.0 - B), 2.0));
    run(&axis, 1e-12, exact);
    FILE *file = fopen(words[2], "w");
    for (int row = 0; row < axis.rows; row++) fprintf(file, "%.17g\n", exact[row]);
    fclose(file);
    for (double tolerance = 1e-2; tolerance > 0.7e-10; tolerance /= sqrt(10.0)) {
        double best = 1e9, error = 0.0;
        for (int again = 0; again < REPETITIONS; again++) {
            axis.calls = 0;
            double begin = now_s();
            run(&axis, tolerance, found);
            best = fmin(best, now_s() - begin);
        }
        for (int row = 0; row < axis.rows; row++)
            error = fmax(error, fabs(found[row] - exact[row]));
        printf("%.3e %.3e %.6e %ld\n", tolerance, error, best, axis.calls);
    }
    return 0;
}
