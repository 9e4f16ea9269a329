/* The control loops of the simulated joints, each step of which is one call.
 *
 * The Python methods JointLoop.reference and JointLoop.effort say what is right. This file does the
 * same additions and products in the same order, so both give the same bits; it has to be compiled
 * without contraction of a product and a sum (-ffp-contract=off). What happens seldom (a command, a
 * jump of the set point, a planned path, a velocity command) is left to those methods.
 */
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <math.h>
#include <structmember.h>

enum { TRAJECTORY, POSITION, VELOCITY };
enum { MOST_JOINTS = 16, COEFFICIENTS = 6 };

typedef struct {
    double p, i, d, lower, upper;
    int antiwindup;
} Gains;

/* The polynomial that holds for a track's time from `begin` up to `end`, and for at most `longest`
 * after `begin`; `count` coefficients: 0 none, 3 of an extrapolation, 6 of a quintic. */
typedef struct {
    double until, delay, begin, end, longest, c[COEFFICIENTS];
    int count;
} Piece;

typedef struct {
    PyObject_HEAD
    PyObject *model, *loop_gains, *mode, *path, *queue;
    int kind;
    char holding, model_based, behind;
    long long saturated_steps;
    double position_setpoint, velocity_setpoint, applied_effort, integral, last_velocity;
    double wanted[3];
    double lower, upper, velocity, effort, standstill, tolerance, damping, friction, stick_band;
    Gains position_gains, velocity_gains;
    Piece piece;
} Cells;

static PyTypeObject CellsType;
static PyObject *reference_name, *piece_name;

/* ---- the mathematics: one function of loop.py, model.py or pid.py each ---------- */

static double friction_effort(const Cells *s, double velocity, double error)
{
    double moving = velocity / s->standstill;
    if (-1.0 < moving && moving < 1.0) {
        if (error != 0.0 && s->stick_band != 0.0) {
            moving += (1.0 - fabs(moving)) * error / s->stick_band;
            moving = moving < -1.0 ? -1.0 : moving > 1.0 ? 1.0 : moving;
        }
        return s->damping * velocity + s->friction * moving;
    }
    return s->damping * velocity + (velocity > 0.0 ? s->friction : -s->friction);
}

static double compute_command(const Gains *g, double *integral, double error, double error_dot,
                              double dt)
{
    double i_term;
    if (!(dt > 0.0 && isfinite(error + error_dot)))
        return 0.0;
    *integral += error * dt;
    i_term = g->i * *integral;
    if (i_term > g->upper)
        i_term = g->upper;
    else if (i_term < g->lower)
        i_term = g->lower;
    else
        return g->p * error + i_term + g->d * error_dot;
    if (g->antiwindup)
        *integral = i_term / g->i;
    return g->p * error + i_term + g->d * error_dot;
}

static double effort(Cells *s, double q, double qdot, double feed_forward, double dt)
{
    const Gains *held = &s->position_gains;
    double error, integral = s->integral, command, wanted;
    int keeps = 1;
    if (s->holding) {
        error = s->position_setpoint - q;
        command = compute_command(held, &integral, error, s->velocity_setpoint - qdot, dt);
        if (s->model_based) {
            feed_forward += friction_effort(s, s->wanted[1], error);
            keeps = held->lower <= held->p * error && held->p * error <= held->upper;
        }
    } else {
        error = s->velocity_setpoint - qdot;
        command = compute_command(&s->velocity_gains, &integral, error,
                                  (s->last_velocity - qdot) / dt, dt);
        if (s->model_based)
            feed_forward += friction_effort(s, s->velocity_setpoint, 0.0);
    }
    s->last_velocity = qdot;
    wanted = command + feed_forward;
    if (wanted > s->effort || wanted < -s->effort) {
        s->saturated_steps++;
        wanted = wanted > s->effort ? s->effort : -s->effort;
    } else if (keeps)
        s->integral = integral;
    return s->applied_effort = wanted;
}

/* Sample the piece that is kept; 0 if it does not hold at t. */
static int sample(const Piece *piece, double t, double *motion)
{
    const double *c = piece->c, due = t - piece->delay, x = due - piece->begin;
    if (!piece->count || t >= piece->until || !(piece->begin <= due && due < piece->end) ||
        x > piece->longest)
        return 0;
    if (piece->count == 3) {
        motion[0] = c[0] + x * (c[1] + 0.5 * x * c[2]);
        motion[1] = c[1] + x * c[2];
        motion[2] = c[2];
        return 1;
    }
    motion[0] = c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * (c[4] + x * c[5]))));
    motion[1] = c[1] + x * (2.0 * c[2] + x * (3.0 * c[3] + x * (4.0 * c[4] + x * 5.0 * c[5])));
    motion[2] = 2.0 * c[2] + x * (6.0 * c[3] + x * (12.0 * c[4] + x * 20.0 * c[5]));
    return 1;
}

/* ---- numbers in and out of Python ---- */

static int numbers(PyObject *from, Py_ssize_t count, double *to)
{
    PyObject *fast = PySequence_Fast(from, "a sequence of numbers is wanted");
    Py_ssize_t k;
    if (!fast)
        return -1;
    if (PySequence_Fast_GET_SIZE(fast) != count) {
        PyErr_Format(PyExc_ValueError, "%zd numbers for %zd", PySequence_Fast_GET_SIZE(fast), count);
        Py_DECREF(fast);
        return -1;
    }
    for (k = 0; k < count; k++)
        to[k] = PyFloat_AsDouble(PySequence_Fast_GET_ITEM(fast, k));
    Py_DECREF(fast);
    return PyErr_Occurred() ? -1 : 0;
}

PyDoc_STRVAR(keep_doc, "Keep the polynomial that holds now: a Piece, or None for none.");

static PyObject *keep_piece(Cells *s, PyObject *piece)
{
    PyObject *c;
    s->piece.count = 0;
    if (piece != Py_None) {
        Py_ssize_t count;
        if (!PyArg_ParseTuple(piece, "dddddO!", &s->piece.until, &s->piece.delay, &s->piece.begin,
                              &s->piece.end, &s->piece.longest, &PyTuple_Type, &c))
            return NULL;
        count = PyTuple_GET_SIZE(c);
        if ((count != 3 && count != COEFFICIENTS) || numbers(c, count, s->piece.c) < 0)
            return PyErr_Occurred() ? NULL : PyErr_Format(PyExc_ValueError, "3 or 6 coefficients");
        s->piece.count = (int)count;
    }
    Py_RETURN_NONE;
}

/* Ask the queue of tracks for the polynomial of time t. */
static int find_piece(Cells *s, PyObject *t)
{
    PyObject *piece = s->queue ? PyObject_CallMethodOneArg(s->queue, piece_name, t) : NULL;
    PyObject *done = piece ? keep_piece(s, piece) : NULL;
    if (!s->queue)
        PyErr_SetString(PyExc_AttributeError, "_queue");
    Py_XDECREF(piece);
    Py_XDECREF(done);
    return done ? 0 : -1;
}

/* Go on to the set point of time t where that is plain; 0: the Python method has to; -1: error. */
static int plain_reference(Cells *s, PyObject *at, double t, double dt, double jump)
{
    double motion[3];
    if (s->kind == TRAJECTORY) {
        if (!sample(&s->piece, t, motion)) {
            if (find_piece(s, at) < 0)
                return -1;
            if (!sample(&s->piece, t, motion))
                return 0;
        }
        if (!(s->lower - s->tolerance <= motion[0] && motion[0] <= s->upper + s->tolerance))
            return 0;
        if (s->model_based && (s->behind || fabs(motion[0] - s->wanted[0]) > jump * s->velocity * dt))
            return 0;
        memcpy(s->wanted, motion, sizeof motion);
    } else if (s->kind != POSITION || s->path != Py_None)
        return 0;
    s->position_setpoint = s->wanted[0];
    s->velocity_setpoint = s->wanted[1] - 0.5 * dt * s->wanted[2];
    return 1;
}

static PyObject *list_of(const double *values, Py_ssize_t count)
{
    PyObject *list = PyList_New(count), *item;
    Py_ssize_t k;
    for (k = 0; list && k < count; k++) {
        if (!(item = PyFloat_FromDouble(values[k])))
            Py_CLEAR(list);
        else
            PyList_SET_ITEM(list, k, item);
    }
    return list;
}

static int call_dynamics(PyObject *dynamics, double (*motion)[MOST_JOINTS], Py_ssize_t n, double *to)
{
    PyObject *args[3] = {NULL, NULL, NULL}, *answer = NULL;
    int k, done = -1;
    for (k = 0; k < 3; k++)
        args[k] = list_of(motion[k], n);
    if (args[0] && args[1] && args[2])
        answer = PyObject_Vectorcall(dynamics, args, 3, NULL);
    if (answer)
        done = numbers(answer, n, to);
    Py_XDECREF(answer);
    for (k = 0; k < 3; k++)
        Py_XDECREF(args[k]);
    return done;
}

static int call_reference(PyObject *loop, PyObject *t, double q, double qdot, PyObject *dt)
{
    PyObject *at = PyFloat_FromDouble(q), *speed = PyFloat_FromDouble(qdot), *answer = NULL;
    if (at && speed)
        answer = PyObject_CallMethodObjArgs(loop, reference_name, t, at, speed, dt, NULL);
    Py_XDECREF(at);
    Py_XDECREF(speed);
    Py_XDECREF(answer);
    return answer ? 0 : -1;
}

PyDoc_STRVAR(efforts_doc, "efforts(loops, t, q, qdot, dt, dynamics, stiffness, damping, jump)\n\n"
                          "Return the efforts of the step that begins at t, as JointControl does.");

static PyObject *efforts(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    double q[MOST_JOINTS], qdot[MOST_JOINTS], forward[MOST_JOINTS] = {0.0}, wanted[3][MOST_JOINTS];
    double t, dt, stiffness, damping, jump;
    Py_ssize_t n, k;
    int plain;
    (void)module;
    if (count != 9 || !PyList_Check(args[0]) || (n = PyList_GET_SIZE(args[0])) > MOST_JOINTS) {
        PyErr_SetString(PyExc_TypeError, "efforts: 9 arguments, the first a list of 16 loops at most");
        return NULL;
    }
    t = PyFloat_AsDouble(args[1]);
    dt = PyFloat_AsDouble(args[4]);
    stiffness = PyFloat_AsDouble(args[6]);
    damping = PyFloat_AsDouble(args[7]);
    jump = PyFloat_AsDouble(args[8]);
    if (PyErr_Occurred() || numbers(args[2], n, q) < 0 || numbers(args[3], n, qdot) < 0)
        return NULL;
    for (k = 0; k < n; k++) {
        Cells *s = (Cells *)PyList_GET_ITEM(args[0], k);
        if (!PyObject_TypeCheck((PyObject *)s, &CellsType)) {
            PyErr_SetString(PyExc_TypeError, "efforts: each loop has to hold compiled cells");
            return NULL;
        }
        plain = plain_reference(s, args[1], t, dt, jump);
        if (plain < 0 ||
            (!plain && call_reference((PyObject *)s, args[1], q[k], qdot[k], args[4]) < 0))
            return NULL;
        wanted[0][k] = s->wanted[0];
        wanted[1][k] = s->wanted[1];
        wanted[2][k] = s->wanted[2] + stiffness * (s->wanted[0] - q[k]) +
                       damping * (s->wanted[1] - 0.5 * dt * s->wanted[2] - qdot[k]);
    }
    if (args[5] != Py_None && call_dynamics(args[5], wanted, n, forward) < 0)
        return NULL;
    for (k = 0; k < n; k++)
        forward[k] = effort((Cells *)PyList_GET_ITEM(args[0], k), q[k], qdot[k], forward[k], dt);
    return list_of(forward, n);
}

/* ---- the type: what JointLoop keeps ---- */

static int number_of(PyObject *from, const char *name, double *to)
{
    PyObject *value = PyObject_GetAttrString(from, name);
    *to = value ? PyFloat_AsDouble(value) : 0.0;
    Py_XDECREF(value);
    return PyErr_Occurred() ? -1 : 0;
}

static int take_gains(PyObject *both, const char *name, Gains *g)
{
    PyObject *from = PyObject_GetAttrString(both, name);
    double antiwindup = 0.0;
    int failed = !from || number_of(from, "p", &g->p) || number_of(from, "i", &g->i) ||
                 number_of(from, "d", &g->d) || number_of(from, "lower", &g->lower) ||
                 number_of(from, "upper", &g->upper) || number_of(from, "antiwindup", &antiwindup);
    g->antiwindup = antiwindup != 0.0;
    Py_XDECREF(from);
    return failed ? -1 : 0;
}

static int set_model(Cells *s, PyObject *m, void *unused)
{
    (void)unused;
    if (!m || number_of(m, "lower", &s->lower) || number_of(m, "upper", &s->upper) ||
        number_of(m, "velocity", &s->velocity) || number_of(m, "effort", &s->effort) ||
        number_of(m, "standstill", &s->standstill) || number_of(m, "tolerance", &s->tolerance) ||
        number_of(m, "damping", &s->damping) || number_of(m, "friction", &s->friction) ||
        number_of(m, "stick_band", &s->stick_band))
        return -1;
    Py_INCREF(m);
    Py_XSETREF(s->model, m);
    return 0;
}

static int set_loop_gains(Cells *s, PyObject *both, void *unused)
{
    (void)unused;
    if (!both || take_gains(both, "position", &s->position_gains) ||
        take_gains(both, "velocity", &s->velocity_gains))
        return -1;
    Py_INCREF(both);
    Py_XSETREF(s->loop_gains, both);
    return 0;
}

static int set_mode(Cells *s, PyObject *mode, void *unused)
{
    const char *text = mode ? PyUnicode_AsUTF8(mode) : NULL;
    (void)unused;
    if (!text)
        return -1;
    s->kind = *text == 't' ? TRAJECTORY : *text == 'p' ? POSITION : VELOCITY;
    Py_INCREF(mode);
    Py_XSETREF(s->mode, mode);
    return 0;
}

static int set_wanted(Cells *s, PyObject *wanted, void *unused)
{
    (void)unused;
    return wanted ? numbers(wanted, 3, s->wanted) : -1;
}

static PyObject *get_wanted(Cells *s, void *unused)
{
    (void)unused;
    return Py_BuildValue("ddd", s->wanted[0], s->wanted[1], s->wanted[2]);
}

static PyObject *object_or_none(PyObject *o) { return Py_NewRef(o ? o : Py_None); }
static PyObject *get_model(Cells *s, void *u) { (void)u; return object_or_none(s->model); }
static PyObject *get_loop_gains(Cells *s, void *u) { (void)u; return object_or_none(s->loop_gains); }
static PyObject *get_mode(Cells *s, void *u) { (void)u; return object_or_none(s->mode); }

static PyGetSetDef getset[] = {
    {"model", (getter)get_model, (setter)set_model, NULL, NULL},
    {"loop_gains", (getter)get_loop_gains, (setter)set_loop_gains, NULL, NULL},
    {"mode", (getter)get_mode, (setter)set_mode, NULL, NULL},
    {"_wanted", (getter)get_wanted, (setter)set_wanted, NULL, NULL},
    {NULL, NULL, NULL, NULL, NULL}};

#define MEMBER(name, type, field) {name, type, offsetof(Cells, field), 0, NULL}
static PyMemberDef members[] = {MEMBER("_path", T_OBJECT, path),
                                MEMBER("_queue", T_OBJECT, queue),
                                MEMBER("holding", T_BOOL, holding),
                                MEMBER("_model_based", T_BOOL, model_based),
                                MEMBER("_behind", T_BOOL, behind),
                                MEMBER("saturated_steps", T_LONGLONG, saturated_steps),
                                MEMBER("position_setpoint", T_DOUBLE, position_setpoint),
                                MEMBER("velocity_setpoint", T_DOUBLE, velocity_setpoint),
                                MEMBER("applied_effort", T_DOUBLE, applied_effort),
                                MEMBER("_integral", T_DOUBLE, integral),
                                MEMBER("_last_velocity", T_DOUBLE, last_velocity),
                                {NULL, 0, 0, 0, NULL}};

static PyMethodDef methods[] = {{"keep_piece", (PyCFunction)keep_piece, METH_O, keep_doc},
                                {NULL, NULL, 0, NULL}};

static int traverse(Cells *s, visitproc visit, void *arg)
{
    Py_VISIT(s->model);
    Py_VISIT(s->loop_gains);
    Py_VISIT(s->mode);
    Py_VISIT(s->path);
    Py_VISIT(s->queue);
    return 0;
}

static int clear(Cells *s)
{
    Py_CLEAR(s->model);
    Py_CLEAR(s->loop_gains);
    Py_CLEAR(s->mode);
    Py_CLEAR(s->path);
    Py_CLEAR(s->queue);
    return 0;
}

static void dealloc(Cells *s)
{
    PyObject_GC_UnTrack(s);
    clear(s);
    Py_TYPE(s)->tp_free((PyObject *)s);
}

static PyTypeObject CellsType = {
    PyVarObject_HEAD_INIT(NULL, 0).tp_name = "_scara_loops.Cells",
    .tp_doc = "What the loop of one joint keeps from step to step.",
    .tp_basicsize = sizeof(Cells),
    .tp_flags = Py_TPFLAGS_DEFAULT | Py_TPFLAGS_BASETYPE | Py_TPFLAGS_HAVE_GC,
    .tp_new = PyType_GenericNew,
    .tp_dealloc = (destructor)dealloc,
    .tp_traverse = (traverseproc)traverse,
    .tp_clear = (inquiry)clear,
    .tp_getset = getset,
    .tp_members = members,
    .tp_methods = methods};

static PyMethodDef functions[] = {
    {"efforts", (PyCFunction)(void (*)(void))efforts, METH_FASTCALL, efforts_doc},
    {NULL, NULL, 0, NULL}};

static struct PyModuleDef definition = {PyModuleDef_HEAD_INIT, "_scara_loops", NULL, -1, functions,
                                        NULL, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit__scara_loops(void)
{
    PyObject *module;
    reference_name = PyUnicode_InternFromString("reference");
    piece_name = PyUnicode_InternFromString("piece");
    if (!reference_name || !piece_name ||
        PyType_Ready(&CellsType) < 0 || !(module = PyModule_Create(&definition)))
        return NULL;
    if (PyModule_AddObjectRef(module, "Cells", (PyObject *)&CellsType) < 0)
        Py_CLEAR(module);
    return module;
}
